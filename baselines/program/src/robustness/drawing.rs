//! The pictures of the curves, and the heat maps of pairs of factors.

use baselines::Estimate;
use fetch_env::EnvId;
use plotters::prelude::*;

use super::measured::{CRITICAL, Pair, Rates, TIMES};
use crate::figures::{
    canvas::{COLORS, FAINT, INK, bold, text},
    chart::Chart,
    heat_map::HeatMap,
    picture::{Area, Backend, DrawError, Drawing},
};

/// The curves of all policies over one factor.
pub struct Curves<'a> {
    pub env_id: EnvId,
    pub factor: &'a str,
    pub episodes: usize,
    pub curves: Vec<Rates>,
}

/// The heights of title and of a line of the legend, and the width of the picture, in pixels.
const TITLE: u32 = 62;
const LINE: u32 = 22;
const WIDTH: u32 = 1120;

impl Drawing for Curves<'_> {
    fn size(&self) -> (u32, u32) {
        (WIDTH, TITLE + LINE * self.curves.len() as u32 + 380)
    }

    fn draw<B: Backend>(&self, area: &Area<B>) -> Result<(), DrawError> {
        let Self { env_id, factor, episodes, curves } = self;
        area.draw_text(&format!("{env_id}: success over {factor}"), &bold(22), (20, 26))?;
        let note = format!("{episodes} episodes for each value, with 95 % intervals");
        area.draw_text(&note, &text(15, FAINT), (20, 50))?;
        let colors = || COLORS.into_iter().cycle();
        for (line, (curve, color)) in curves.iter().zip(colors()).enumerate() {
            let y = (TITLE + LINE * line as u32 + LINE / 2) as i32;
            area.draw(&Rectangle::new([(22, y - 6), (46, y + 6)], color.mix(0.3).filled()))?;
            area.draw(&PathElement::new([(22, y), (46, y)], color.stroke_width(3)))?;
            area.draw_text(&curve.policy, &text(15, INK), (56, y))?;
        }
        let (_, charts) = area.split_vertically(TITLE + LINE * curves.len() as u32);
        let (left, right) = charts.split_horizontally(WIDTH / 2);
        let values = || curves.iter().flat_map(|curve| &curve.end).map(|(value, _)| *value);
        let (least, most) = (values().reduce(f64::min), values().reduce(f64::max));
        let range = match (least.unwrap_or(0.0), most.unwrap_or(1.0)) {
            (least, most) if least == most => least - 0.5..most + 0.5,
            (least, most) => least..most,
        };
        for ((name, at), area) in TIMES.into_iter().zip([left, right]) {
            let chart = Chart {
                label: factor,
                rate: &format!("success rate at {name}"),
                range: range.clone(),
                curves: colors().zip(curves.iter().map(|curve| curve.at(at))).collect(),
                has_dots: true,
                line: (CRITICAL, String::new()),
            };
            chart.draw(&area)?;
        }
        Ok(())
    }
}

/// Returns the heat map of a pair of factors: the success at the end.
pub fn heat_map(env_id: EnvId, episodes: usize, pair: &Pair) -> HeatMap {
    let [rows, columns] = &pair.factors;
    let labels = |factor: &str, values: &[f64]| -> Vec<Vec<String>> {
        values.iter().map(|value| vec![format!("{factor} {value}")]).collect()
    };
    let cell = |[end, any]: [Estimate; 2]| (end, format!("at any time {:.2}", any.value));
    HeatMap {
        title: format!("{env_id}, {}: success rate at the end", pair.rows[0].policy),
        fixed: format!("{episodes} episodes for each cell, with 95 % intervals"),
        row_labels: labels(&rows.factor, &rows.values),
        column_labels: labels(&columns.factor, &columns.values),
        cells: pair.cells().map(cell).collect(),
    }
}
