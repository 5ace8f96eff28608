//! The parts of an observation, and a policy's network that takes them.

use fetch_env::{FetchObservation, ObservationField, observation_fields};
use fetch_sim::Task;
use plotters::prelude::*;

use super::{
    canvas::{BLUE, FAINT, INK, RED, bold, centered, text},
    picture::{Area, Backend, DrawError, Drawing},
};

pub struct ObservationLayout;

/// The upper left and lower right corner of a box.
type Corners = [(i32, i32); 2];

const OBSERVATION: Corners = [(20, 90), (600, 360)];
const ACHIEVED: Corners = [(20, 385), (600, 445)];
const DESIRED: Corners = [(20, 470), (600, 530)];

impl Drawing for ObservationLayout {
    fn size(&self) -> (u32, u32) {
        (1120, 580)
    }

    fn draw<B: Backend>(&self, area: &Area<B>) -> Result<(), DrawError> {
        area.draw_text("What a policy observes", &bold(24), (20, 28))?;
        let line = "FetchReach, and in brackets FetchPush, FetchPickAndPlace and FetchSlide";
        area.draw_text(line, &text(16, FAINT), (20, 60))?;

        let inputs = [(OBSERVATION, INK), (ACHIEVED, BLUE), (DESIRED, RED)];
        let [reach, push] = [Task::Reach, Task::Push].map(FetchObservation::len_of);
        let names = [
            &format!("observation: {reach} ({push}) numbers"),
            "achieved_goal: 3 numbers",
            "desired_goal: 3 numbers",
        ];
        let notes = ["", "where the gripper (the object) is, in m", "where it should be, in m"];
        for (((corners, color), name), note) in inputs.into_iter().zip(names).zip(notes) {
            area.draw(&Rectangle::new(corners, color.stroke_width(2)))?;
            let [(left, top), _] = corners;
            area.draw_text(name, &bold(16).color(&color), (left + 14, top + 20))?;
            area.draw_text(note, &text(14, INK), (left + 14, top + 42))?;
        }
        draw_fields(area)?;

        let encoders = inputs.map(|([(_, top), (_, bottom)], color)| {
            let middle = (top + bottom) / 2;
            ([(660, middle - 26), (760, middle + 26)], color)
        });
        let concatenated: Corners = [(810, 235), (930, 385)];
        for ((input, color), (encoder, _)) in inputs.into_iter().zip(encoders) {
            labeled(area, encoder, color, &["encoder"])?;
            arrow(area, right_of(input), left_of(encoder))?;
            arrow(area, right_of(encoder), left_of(concatenated))?;
        }
        let features = format!("{} ({})", reach + 6, push + 6);
        labeled(area, concatenated, INK, &["concatenated", &features, "features"])?;
        let policy: Corners = [(980, 235), (1100, 385)];
        labeled(area, policy, INK, &["policy", "action: 4", "dx, dy, dz,", "gripper"])?;
        arrow(area, right_of(concatenated), left_of(policy))?;
        let note = "HER swaps desired_goal, and recomputes the reward from both goals.";
        area.draw_text(note, &text(14, FAINT), (20, 556))?;
        Ok(())
    }
}

/// Draws a line for each field: its elements in Reach, its elements with an object, name, unit and
/// meaning.
fn draw_fields<B: Backend>(area: &Area<B>) -> Result<(), DrawError> {
    let [(left, top), _] = OBSERVATION;
    let elements =
        |field: &ObservationField| format!("{}-{}", field.range.start, field.range.end - 1);
    for (y, field) in (top + 48..).step_by(24).zip(observation_fields(Task::Push)) {
        let reach = ObservationField::find(Task::Reach, field.name);
        let reach = reach.map_or_else(|| "-".into(), elements);
        let unit = field.unit.replace("/step", " per step");
        for (x, column) in [
            (14, reach),
            (58, format!("({})", elements(field))),
            (130, field.name.into()),
            (258, unit),
        ] {
            area.draw_text(&column, &text(13, INK), (left + x, y))?;
        }
        area.draw_text(field.summary, &text(13, FAINT), (left + 358, y))?;
    }
    Ok(())
}

fn labeled<B: Backend>(
    area: &Area<B>,
    corners: Corners,
    color: RGBColor,
    lines: &[&str],
) -> Result<(), DrawError> {
    area.draw(&Rectangle::new(corners, color.stroke_width(2)))?;
    let [(left, top), (right, bottom)] = corners;
    let first = (top + bottom) / 2 - 11 * (lines.len() as i32 - 1);
    for (y, line) in (first..).step_by(22).zip(lines) {
        area.draw_text(line, &centered(15, INK), ((left + right) / 2, y))?;
    }
    Ok(())
}

fn arrow<B: Backend>(area: &Area<B>, from: (i32, i32), to: (i32, i32)) -> Result<(), DrawError> {
    area.draw(&PathElement::new([from, to], INK))?;
    let (dx, dy) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
    let length = dx.hypot(dy);
    let (dx, dy) = (dx / length, dy / length);
    let back = |side: f64| {
        let (x, y) = (10.0 * dx - 4.0 * side * dy, 10.0 * dy + 4.0 * side * dx);
        (to.0 - x.round() as i32, to.1 - y.round() as i32)
    };
    area.draw(&Polygon::new([to, back(1.0), back(-1.0)], INK))?;
    Ok(())
}

fn left_of([(left, top), (_, bottom)]: Corners) -> (i32, i32) {
    (left, (top + bottom) / 2)
}

fn right_of([(_, top), (right, bottom)]: Corners) -> (i32, i32) {
    (right, (top + bottom) / 2)
}
