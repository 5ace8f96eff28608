//! A chart of success rates with their 95 % bands.

use std::ops::Range;

use baselines::Estimate;
use plotters::prelude::*;

use super::{
    canvas::{FAINT, INK, RED, text},
    picture::{Area, Backend, DrawError, FONT},
};

/// Success rates over a number.
pub struct Chart<'a> {
    /// The number's name and unit.
    pub label: &'a str,
    /// What is a success.
    pub rate: &'a str,
    /// The numbers that are shown.
    pub range: Range<f64>,
    /// The color and the points of each curve.
    pub curves: Vec<(RGBColor, &'a [(f64, Estimate)])>,
    /// Whether each point has a dot.
    pub has_dots: bool,
    /// A success rate with a dashed line, and its name.
    pub line: (f64, String),
}

impl Chart<'_> {
    pub fn draw<B: Backend>(&self, area: &Area<B>) -> Result<(), DrawError> {
        let Range { start, end } = self.range;
        let mut chart = ChartBuilder::on(area)
            .margin_top(14)
            .margin_right(30)
            .margin_bottom(10)
            .margin_left(10)
            .x_label_area_size(52)
            .y_label_area_size(74)
            .build_cartesian_2d(start..end, 0.0..1.0)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(FAINT.mix(0.25))
            .axis_style(INK)
            .x_desc(self.label)
            .y_desc(self.rate)
            .axis_desc_style((FONT, 15).into_font().color(&INK))
            .label_style((FONT, 14).into_font().color(&INK))
            .x_labels(6)
            .x_label_formatter(&|x| ((1e4 * x).round() / 1e4).to_string())
            .y_labels(6)
            .y_label_formatter(&|y| format!("{y:.1}"))
            .draw()?;
        for (color, points) in &self.curves {
            let low = points.iter().map(|(x, rate)| (*x, rate.low.max(0.0)));
            let high = points.iter().rev().map(|(x, rate)| (*x, rate.high.min(1.0)));
            let outline: Vec<_> = low.chain(high).collect();
            chart.draw_series([Polygon::new(outline, color.mix(0.2).filled())])?;
            let rates = points.iter().map(|(x, rate)| (*x, rate.value));
            chart.draw_series(LineSeries::new(rates.clone(), color.stroke_width(3)))?;
            if self.has_dots {
                chart.draw_series(rates.map(|at| Circle::new(at, 4, color.filled())))?;
            }
        }
        let (rate, name) = &self.line;
        chart.draw_series(DashedLineSeries::new(
            [(start, *rate), (end, *rate)],
            6,
            5,
            RED.into(),
        ))?;
        let at = (start + 0.01 * (end - start), rate - 0.04);
        chart.draw_series([Text::new(name.clone(), at, text(14, RED))])?;
        Ok(())
    }
}
