//! Plots as inline SVG. Colors are classes of `style.css`, so that they follow light and dark.

use std::fmt::Write;

use super::document::escape;

const WIDTH: f64 = 380.0;
const LEFT: f64 = 50.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 46.0;
const BOTTOM: f64 = 40.0;
const INNER_HEIGHT: f64 = 170.0;

/// An axis: label with its unit, and the range that is shown.
#[derive(Clone, Debug)]
pub struct Axis {
    label: &'static str,
    low: f64,
    high: f64,
}

impl Axis {
    pub const fn new(label: &'static str, low: f64, high: f64) -> Self {
        Self { label, low, high }
    }

    /// The range of some values, with a margin.
    pub fn around(label: &'static str, values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = range(values);
        let margin = if high > low { 0.05 * (high - low) } else { 0.5 };
        Self::new(label, low - margin, high + margin)
    }

    const fn extent(&self) -> f64 {
        self.high - self.low
    }

    /// The share of the axis that lies below a value; within the axis.
    const fn share(&self, value: f64) -> f64 {
        ((value - self.low) / self.extent()).clamp(0.0, 1.0)
    }

    /// Round numbers in the range, four to nine of them, and their number of decimals.
    fn ticks(&self) -> (Vec<f64>, usize) {
        let magnitude = 10_f64.powf((self.extent() / 5.0).log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .map(|factor| factor * magnitude)
            .into_iter()
            .find(|step| self.extent() / step <= 6.0)
            .unwrap_or(10.0 * magnitude);
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        ((first..=last).map(|k| k as f64 * step).collect(), decimals)
    }
}

/// The least and the greatest of some values; infinite if there are none.
pub fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values
        .into_iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// A plot that is drawn mark by mark, later ones over earlier ones.
#[derive(Debug)]
pub struct Plot {
    title: String,
    x: Axis,
    y: Axis,
    inner_height: f64,
    marks: String,
    legend: Vec<(&'static str, &'static str)>,
}

impl Plot {
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        let (marks, legend) = (String::new(), Vec::new());
        Self { title: escape(title), x, y, inner_height: INNER_HEIGHT, marks, legend }
    }

    /// Makes a meter as long along y as along x.
    pub fn equal_scale(mut self) -> Self {
        self.inner_height = (WIDTH - LEFT - RIGHT) * self.y.extent() / self.x.extent();
        self
    }

    /// Names a class in the legend.
    pub fn legend(&mut self, class: &'static str, name: &'static str) {
        self.legend.push((class, name));
    }

    fn x(&self, value: f64) -> f64 {
        LEFT + (WIDTH - LEFT - RIGHT) * self.x.share(value)
    }

    fn y(&self, value: f64) -> f64 {
        TOP + self.inner_height * (1.0 - self.y.share(value))
    }

    fn path(&self, points: impl IntoIterator<Item = (f64, f64)>) -> String {
        let mut path = String::new();
        for (x, y) in points {
            let command = if path.is_empty() { 'M' } else { 'L' };
            let _ = write!(path, "{command}{:.1} {:.1}", self.x(x), self.y(y));
        }
        path
    }

    /// A line through points.
    pub fn line(&mut self, class: &str, points: impl IntoIterator<Item = (f64, f64)>) {
        self.marks += &format!("<path class=\"line {class}\" d=\"{}\"/>\n", self.path(points));
    }

    /// A vertical line over the whole height.
    pub fn vertical(&mut self, class: &str, x: f64) {
        self.line(class, [(x, self.y.low), (x, self.y.high)]);
    }

    /// The area between two lines: of (x, low, high).
    pub fn band(&mut self, class: &str, points: &[(f64, f64, f64)]) {
        let low = points.iter().map(|&(x, low, _)| (x, low));
        let high = points.iter().rev().map(|&(x, _, high)| (x, high));
        self.marks +=
            &format!("<path class=\"area {class}\" d=\"{}Z\"/>\n", self.path(low.chain(high)));
    }

    /// A rectangle between two corners, as far as it is within the axes.
    pub fn rectangle(&mut self, class: &str, from: (f64, f64), to: (f64, f64)) {
        let corners = [from, (to.0, from.1), to, (from.0, to.1)];
        self.marks += &format!("<path class=\"{class}\" d=\"{}Z\"/>\n", self.path(corners));
    }

    /// Dots; short strokes with round ends, since they are many.
    pub fn dots(&mut self, class: &str, points: impl IntoIterator<Item = (f64, f64)>) {
        let mut path = String::new();
        for (x, y) in points {
            let _ = write!(path, "M{:.1} {:.1}h0", self.x(x), self.y(y));
        }
        self.marks += &format!("<path class=\"dots {class}\" d=\"{path}\"/>\n");
    }

    /// The plot as an SVG element.
    pub fn svg(&self) -> String {
        let (right, bottom) = (WIDTH - RIGHT, TOP + self.inner_height);
        let height = bottom + BOTTOM;
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"img\" aria-label=\"{title}\">\n\
             <text class=\"title\" x=\"4\" y=\"16\">{title}</text>\n",
            title = self.title,
        );
        let mut at = 4.0;
        for (class, name) in &self.legend {
            let _ = writeln!(
                svg,
                "<rect class=\"bar {class}\" x=\"{at:.0}\" y=\"25\" width=\"10\" height=\"10\"/>\
                 <text x=\"{:.0}\" y=\"34\">{}</text>",
                at + 14.0,
                escape(name),
            );
            at += 28.0 + 6.0 * name.len() as f64;
        }
        let (ticks, decimals) = self.x.ticks();
        for tick in ticks {
            let x = self.x(tick);
            let _ = writeln!(
                svg,
                "<path class=\"grid-line\" d=\"M{x:.1} {TOP}V{bottom:.1}\"/>\
                 <text class=\"tick\" x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                bottom + 14.0,
                number(tick, decimals),
            );
        }
        let (ticks, decimals) = self.y.ticks();
        for tick in ticks {
            let y = self.y(tick);
            let _ = writeln!(
                svg,
                "<path class=\"grid-line\" d=\"M{LEFT} {y:.1}H{right}\"/>\
                 <text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                LEFT - 5.0,
                y + 4.0,
                number(tick, decimals),
            );
        }
        let (middle_x, middle_y) = ((LEFT + right) / 2.0, (TOP + bottom) / 2.0);
        let _ = write!(
            svg,
            "{marks}<path class=\"axis\" d=\"M{LEFT} {TOP}V{bottom:.1}H{right}\"/>\n\
             <text x=\"{middle_x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate(12 {middle_y:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n\
             </svg>",
            bottom + 32.0,
            escape(self.x.label),
            escape(self.y.label),
            marks = self.marks,
        );
        svg
    }
}

/// A number with a proper minus sign, and with none before zero.
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let is_zero = text.chars().all(|c| c == '0' || c == '.');
    if value < 0.0 && !is_zero { format!("\u{2212}{text}") } else { text }
}
