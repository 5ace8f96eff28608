//! The environments' dense and sparse rewards over the distance.

use std::ops::Range;

use goal_reward::{DistanceReward, DistanceThreshold, GoalReward, RewardKind};
use plotters::prelude::*;

use super::{
    canvas::{BLUE, FAINT, INK, RED, bold, text},
    picture::{Area, Backend, DrawError, Drawing, FONT},
};

pub struct RewardCurves;

/// The range of distances, in meters.
const DISTANCES: Range<f64> = 0.0..0.2;
const POINTS: u32 = 400;

impl Drawing for RewardCurves {
    fn size(&self) -> (u32, u32) {
        (1120, 520)
    }

    fn draw<B: Backend>(&self, area: &Area<B>) -> Result<(), DrawError> {
        area.draw_text("Dense and sparse reward", &bold(24), (20, 28))?;
        let (_, charts) = area.split_vertically(56);
        let (left, right) = charts.split_horizontally(560);
        let title = "dense: minus the distance, better with every step nearer";
        chart(&left, RewardKind::Dense, -0.21..0.01, title, "reward (m)")?;
        let title = "sparse: 0 within the threshold, -1 beyond";
        chart(&right, RewardKind::Sparse, -1.05..0.05, title, "reward (no unit)")
    }
}

fn chart<B: Backend>(
    area: &Area<B>,
    kind: RewardKind,
    range: Range<f64>,
    title: &str,
    unit: &str,
) -> Result<(), DrawError> {
    let reward = DistanceReward::new(kind, DistanceThreshold::FETCH);
    let threshold = reward.threshold().get();
    area.draw_text(title, &text(17, INK), (70, 18))?;
    let mut chart = ChartBuilder::on(area)
        .margin_top(40)
        .margin_right(30)
        .margin_bottom(10)
        .margin_left(10)
        .x_label_area_size(52)
        .y_label_area_size(74)
        .build_cartesian_2d(DISTANCES, range.clone())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT.mix(0.25))
        .axis_style(INK)
        .x_desc("distance between achieved and desired goal (m)")
        .y_desc(unit)
        .axis_desc_style((FONT, 15).into_font().color(&INK))
        .label_style((FONT, 14).into_font().color(&INK))
        .x_labels(5)
        .x_label_formatter(&|x| format!("{x:.2}"))
        .y_labels(6)
        .y_label_formatter(&|y| format!("{:.2}", (100.0 * y).round() / 100.0 + 0.0)) // not -0
        .draw()?;
    let step = (DISTANCES.end - DISTANCES.start) / f64::from(POINTS);
    let curve = (0..=POINTS).map(|point| {
        let distance = DISTANCES.start + step * f64::from(point);
        (distance, reward.reward(&[distance, 0.0, 0.0], &[0.0; 3]))
    });
    chart.draw_series(LineSeries::new(curve, BLUE.stroke_width(3)))?;
    let line =
        DashedLineSeries::new([(threshold, range.start), (threshold, range.end)], 6, 5, RED.into());
    chart.draw_series(line)?;
    let label = format!("threshold {threshold} m");
    let low = range.start + 0.15 * (range.end - range.start);
    chart.draw_series([Text::new(label, (threshold + 0.003, low), text(14, RED))])?;
    Ok(())
}
