//! Plots as inline SVG that follows the page's light and dark colors.

use std::ops::Range;

use plotters::{
    coord::types::RangedCoordf64,
    element::DashedPathElement,
    prelude::*,
    style::{
        FontTransform, TextStyle,
        text_anchor::{HPos, Pos, VPos},
    },
};

use super::{axis::Axis, document::escape, error::PageError};

/// Units of the drawing for each unit of the layout below: plotters' coordinates are integers.
const SCALE: i32 = 4;
const WIDTH: i32 = 380 * SCALE;
const LEFT: i32 = 50 * SCALE;
const RIGHT: i32 = WIDTH - 14 * SCALE;
const TOP: i32 = 46 * SCALE;
const BELOW: i32 = 40 * SCALE;
const INNER_HEIGHT: i32 = 170 * SCALE;

/// How the placeholder of an [`Ink`] begins in SVG, and that of dots, which [`dotted`] recognizes.
const SOLID: &str = "\"#0102";
const DOTTED: &str = "\"#0103";

/// The maximum height of the drawing's inner part: far more than any screen shows.
const MOST_INNER_HEIGHT: i32 = 100 * WIDTH;

/// A color of the page: a custom property of its style sheet, which differs in light and dark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// The color of text.
    Text,
    /// The color of less important text.
    Faint,
    /// The color of rules and grids.
    Rule,
    /// The color of large areas.
    Area,
    /// Blue.
    Blue,
    /// Orange.
    Orange,
    /// Red.
    Red,
    /// Teal.
    Teal,
}

impl Ink {
    /// The custom properties, in the order of the variants.
    const PROPERTIES: [&'static str; 8] =
        ["text", "faint", "rule", "area", "blue", "orange", "red", "teal"];

    /// Returns the color that stands for this one until the drawing is finished.
    const fn placeholder(self) -> RGBColor {
        RGBColor(1, 2, self as u8)
    }
}

/// Coordinates of the data.
type Point = (f64, f64);

/// A plot. Later marks cover earlier ones, and all stay within the axes.
///
/// ```
/// use baselines::page::{Axis, Ink, Plot};
///
/// let axes = (Axis::new("step", 0.0, 3.0), Axis::new("reward", -1.0, 0.0));
/// let mut plot = Plot::new("Rewards", axes.0, axes.1);
/// plot.line(Ink::Blue, [(0.0, -1.0), (1.0, -0.4), (2.0, 0.0)]);
/// plot.legend(Ink::Blue, "trained");
/// assert!(plot.svg()?.starts_with("<svg "));
/// # Ok::<(), baselines::page::PageError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Plot {
    title: String,
    x: Axis,
    y: Axis,
    inner_height: i32,
    marks: Vec<Mark>,
    legend: Vec<(Ink, String)>,
}

/// A shape through points.
#[derive(Clone, Debug)]
struct Mark {
    ink: Ink,
    look: Look,
    points: Vec<Point>,
}

#[derive(Clone, Copy, Debug)]
enum Look {
    /// A line of this width.
    Line(u32),
    Dashes,
    /// A polygon of this opacity.
    Fill(f64),
    /// A dot of this radius and opacity at each point.
    Dots(u32, f64),
}

impl Plot {
    /// Returns an empty plot.
    #[must_use]
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        let (marks, legend) = (Vec::new(), Vec::new());
        Self { title: title.into(), x, y, inner_height: INNER_HEIGHT, marks, legend }
    }

    /// Makes a unit as long along y as along x.
    #[must_use]
    pub fn with_equal_scale(mut self) -> Self {
        let height = f64::from(RIGHT - LEFT) * self.y.length() / self.x.length();
        self.inner_height = height.round() as i32;
        self
    }

    /// Names a color in the legend.
    pub fn legend(&mut self, ink: Ink, name: &str) {
        self.legend.push((ink, name.into()));
    }

    fn mark(&mut self, ink: Ink, look: Look, points: impl IntoIterator<Item = Point>) {
        let clamp = |(x, y)| (self.x.clamp(x), self.y.clamp(y));
        let points = points.into_iter().map(clamp).collect();
        self.marks.push(Mark { ink, look, points });
    }

    /// Draws a line through points.
    pub fn line(&mut self, ink: Ink, points: impl IntoIterator<Item = Point>) {
        self.mark(ink, Look::Line(7), points);
    }

    /// Draws a dashed vertical line.
    pub fn vertical(&mut self, x: f64) {
        let Range { start, end } = self.y.range;
        self.mark(Ink::Text, Look::Dashes, [(x, start), (x, end)]);
    }

    /// Draws the area between two lines through points (x, low, high).
    pub fn band(&mut self, ink: Ink, points: &[(f64, f64, f64)]) {
        let low = points.iter().map(|&(x, low, _)| (x, low));
        let high = points.iter().rev().map(|&(x, _, high)| (x, high));
        self.mark(ink, Look::Fill(0.22), low.chain(high));
    }

    /// Draws a translucent rectangle between two opposite corners.
    pub fn bar(&mut self, ink: Ink, from: Point, to: Point) {
        self.mark(ink, Look::Fill(0.5), outline(from, to));
    }

    /// Draws a rectangle with a border between two opposite corners: a background.
    pub fn area(&mut self, from: Point, to: Point) {
        self.mark(Ink::Area, Look::Fill(1.0), outline(from, to));
        self.mark(Ink::Faint, Look::Line(3), outline(from, to));
    }

    /// Draws many small dots.
    pub fn dots(&mut self, ink: Ink, points: impl IntoIterator<Item = Point>) {
        self.mark(ink, Look::Dots(6, 0.7), points);
    }

    /// Draws one large dot.
    pub fn dot(&mut self, ink: Ink, point: Point) {
        self.mark(ink, Look::Dots(16, 1.0), [point]);
    }

    /// Returns the plot as an SVG element for a [`Document`](super::Document).
    ///
    /// # Errors
    /// [`PageError::Plot`] if an axis or its length is not finite, if it ends before it starts, if
    /// an [equal scale](Self::with_equal_scale) makes the plot more than a hundred times as high as
    /// wide, or if the plotting library fails.
    pub fn svg(&self) -> Result<String, PageError> {
        let failed = |reason| PageError::Plot { plot: self.title.clone(), reason };
        for axis in [&self.x, &self.y] {
            let Axis { label, range } = axis;
            // The plotting library would search forever for the ticks of an infinite length.
            if !(axis.length().is_finite() && axis.length() >= 0.0) {
                return Err(failed(format!(
                    "the axis {label:?} is {range:?}: make its length finite"
                )));
            }
        }
        if self.inner_height > MOST_INNER_HEIGHT {
            let reason = "it is too high: leave its axes at different scales";
            return Err(failed(reason.into()));
        }
        let height = TOP + self.inner_height + BELOW;
        let mut svg = String::new();
        let size = (WIDTH as u32, height.max(1) as u32);
        self.draw(SVGBackend::with_string(&mut svg, size).into_drawing_area())
            .map_err(|error| failed(error.to_string()))?;
        svg = svg.lines().map(dotted).collect();
        for (ink, property) in Ink::PROPERTIES.iter().enumerate() {
            svg = svg.replace(&format!("{SOLID}{ink:02X}\""), &format!("\"var(--{property})\""));
        }
        // The style sheet sets the font.
        for default in [
            " opacity=\"1\"",
            " stroke=\"none\"",
            " stroke-width=\"1\"",
            " font-family=\"sans-serif\"",
        ] {
            svg = svg.replace(default, "");
        }
        // The first tag has a fixed size, and a namespace that HTML does not need.
        let body = svg.split_once('>').map_or("", |(_, body)| body);
        let title = escape(&self.title);
        Ok(format!(
            "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{title}\">{body}"
        ))
    }

    fn draw<B: DrawingBackend>(
        &self,
        whole: DrawingArea<B, plotters::coord::Shift>,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let bottom = TOP + self.inner_height;
        let pixels = (LEFT..RIGHT, bottom..TOP);
        let axes = Cartesian2d::<RangedCoordf64, RangedCoordf64>::new(
            self.x.range.clone(),
            self.y.range.clone(),
            pixels,
        );
        let inner = whole.clone().apply_coord_spec(axes);
        let place = |point: Point| inner.map_coordinate(&point);

        let bold = text(13, Ink::Text, HPos::Left, true);
        whole.draw_text(&self.title, &bold, (4 * SCALE, 12 * SCALE))?;
        let mut left = 4 * SCALE;
        for (ink, name) in &self.legend {
            let (top, side) = (25 * SCALE, 10 * SCALE);
            let corners = [(left, top), (left + side, top + side)];
            whole.draw(&Rectangle::new(corners, ink.placeholder().mix(0.5).filled()))?;
            let at = (left + 14 * SCALE, top + side / 2);
            whole.draw_text(name, &text(11, Ink::Text, HPos::Left, false), at)?;
            left += (28 + 6 * name.chars().count() as i32) * SCALE;
        }

        let grid = Ink::Rule.placeholder().stroke_width(2);
        let middle = text(11, Ink::Faint, HPos::Center, false);
        for (tick, label) in self.x.ticks() {
            let x = place((tick, self.y.range.start)).0;
            whole.draw(&PathElement::new([(x, TOP), (x, bottom)], grid))?;
            whole.draw_text(&label, &middle, (x, bottom + 10 * SCALE))?;
        }
        let right = text(11, Ink::Faint, HPos::Right, false);
        for (tick, label) in self.y.ticks() {
            let y = place((self.x.range.start, tick)).1;
            whole.draw(&PathElement::new([(LEFT, y), (RIGHT, y)], grid))?;
            whole.draw_text(&label, &right, (LEFT - 5 * SCALE, y))?;
        }

        for Mark { ink, look, points } in &self.marks {
            let solid = ink.placeholder();
            match *look {
                Look::Line(width) => {
                    inner.draw(&PathElement::new(points.clone(), solid.stroke_width(width)))?;
                }
                Look::Dashes => {
                    let (ends, style) = (points.iter().copied(), solid.stroke_width(5));
                    inner.draw(&DashedPathElement::new(ends, 4 * SCALE, 3 * SCALE, style))?;
                }
                Look::Fill(opacity) => {
                    inner.draw(&Polygon::new(points.clone(), solid.mix(opacity).filled()))?;
                }
                Look::Dots(radius, opacity) => {
                    let style = RGBColor(1, 3, *ink as u8).mix(opacity).stroke_width(2 * radius);
                    inner.draw(&PathElement::new(points.clone(), style))?;
                }
            }
        }

        let axis = Ink::Faint.placeholder().stroke_width(SCALE as u32);
        whole.draw(&PathElement::new([(LEFT, TOP), (LEFT, bottom), (RIGHT, bottom)], axis))?;
        let label = text(11, Ink::Text, HPos::Center, false);
        let (middle_x, middle_y) = ((LEFT + RIGHT) / 2, (TOP + bottom) / 2);
        whole.draw_text(&self.x.label, &label, (middle_x, bottom + 28 * SCALE))?;
        let upward = label.transform(FontTransform::Rotate270);
        whole.draw_text(&self.y.label, &upward, (9 * SCALE, middle_y))?;
        whole.present()
    }
}

/// Returns a line of SVG in which dots replace a polyline through them: lines of no length with
/// round ends, which take a fifth of the space of circles.
fn dotted(line: &str) -> String {
    let Some((look, points)) = line.split_once(" points=\"").filter(|_| line.contains(DOTTED))
    else {
        return format!("{line}\n");
    };
    let points = points.trim_end_matches("\"/>").split_whitespace();
    let dots: String = points.map(|point| format!("M{point}h0")).collect();
    let look = look.replace("polyline", "path").replace(DOTTED, SOLID);
    format!("{look} stroke-linecap=\"round\" d=\"{dots}\"/>\n")
}

/// Returns the corners of a rectangle, the first of them twice.
fn outline(from: Point, to: Point) -> [Point; 5] {
    [from, (to.0, from.1), to, (from.0, to.1), from]
}

/// Returns the style of a text that is vertically centered on its anchor.
fn text(size: u32, ink: Ink, h_pos: HPos, bold: bool) -> TextStyle<'static> {
    let style = if bold { FontStyle::Bold } else { FontStyle::Normal };
    // plotters divides the size by this for SVG.
    let size = 1.24 * f64::from(size) * f64::from(SCALE);
    let font = ("sans-serif", size, style).into_font();
    font.color(&ink.placeholder()).pos(Pos::new(h_pos, VPos::Center))
}
