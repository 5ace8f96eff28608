//! The picture of a group's curves: the success rate over steps and over seconds.

use baselines::runs::{Band, Group};
use plotters::prelude::*;

use crate::figures::{
    canvas::{BLUE, FAINT, INK, RED, bold, text},
    picture::{Area, Backend, DrawError, Drawing, FONT},
};

/// Width of the title, in pixels.
const ROOM: u32 = 1080;

pub struct Curves {
    name: String,
    legend: String,
    target: f64,
    over_steps: Vec<Band>,
    over_seconds: Vec<Band>,
}

impl Curves {
    pub fn new(group: &Group) -> anyhow::Result<Self> {
        let legend = match group.num_runs() {
            1 => "one run".to_owned(),
            runs => format!("interquartile mean of {runs} runs, with the 95 % bootstrap interval"),
        };
        Ok(Self {
            name: group.name().to_owned(),
            legend,
            target: group.target(),
            over_steps: group.bands(|point| point.steps as f64 / 1e3)?,
            over_seconds: group.bands(|point| point.seconds)?,
        })
    }
}

impl Drawing for Curves {
    fn size(&self) -> (u32, u32) {
        (1120, 440)
    }

    fn draw<B: Backend>(&self, area: &Area<B>) -> Result<(), DrawError> {
        // A long name is set smaller.
        let (width, _) = area.estimate_text_size(&self.name, &bold(22))?;
        let size = (22 * ROOM / width.max(1)).min(22);
        area.draw_text(&self.name, &bold(size), (20, 28))?;
        area.draw_text(&self.legend, &text(15, INK), (20, 54))?;
        let (_, charts) = area.split_vertically(68);
        let (left, right) = charts.split_horizontally(560);
        chart(&left, &self.over_steps, self.target, "environment steps (thousands)")?;
        chart(&right, &self.over_seconds, self.target, "seconds of training")
    }
}

fn chart<B: Backend>(
    area: &Area<B>,
    bands: &[Band],
    target: f64,
    label: &str,
) -> Result<(), DrawError> {
    let end = bands.last().map_or(1.0, |(x, _)| *x);
    let mut chart = ChartBuilder::on(area)
        .margin_top(14)
        .margin_right(30)
        .margin_bottom(10)
        .margin_left(10)
        .x_label_area_size(52)
        .y_label_area_size(74)
        .build_cartesian_2d(0.0..end, 0.0..1.0)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT.mix(0.25))
        .axis_style(INK)
        .x_desc(label)
        .y_desc("success rate of greedy episodes")
        .axis_desc_style((FONT, 15).into_font().color(&INK))
        .label_style((FONT, 14).into_font().color(&INK))
        .x_labels(6)
        .x_label_formatter(&|x| ((10.0 * x).round() / 10.0).to_string())
        .y_labels(6)
        .y_label_formatter(&|y| format!("{y:.1}"))
        .draw()?;
    let low = bands.iter().map(|(x, estimate)| (*x, estimate.low));
    let high = bands.iter().rev().map(|(x, estimate)| (*x, estimate.high));
    let outline: Vec<_> = low.chain(high).collect();
    chart.draw_series([Polygon::new(outline, BLUE.mix(0.2).filled())])?;
    let means = bands.iter().map(|(x, estimate)| (*x, estimate.value));
    chart.draw_series(LineSeries::new(means, BLUE.stroke_width(3)))?;
    chart.draw_series(DashedLineSeries::new([(0.0, target), (end, target)], 6, 5, RED.into()))?;
    let name = format!("target {target}");
    chart.draw_series([Text::new(name, (0.01 * end, target - 0.04), text(14, RED))])?;
    Ok(())
}
