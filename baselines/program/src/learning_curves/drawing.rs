//! The picture of a group's curves: the success rate over steps and over seconds.

use crate::figures::{
    canvas::{BLUE, INK, bold, text},
    chart::Chart,
    picture::{Area, Backend, DrawError, Drawing},
};
use baselines::runs::{Band, Group};

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
        let chart = |label, bands: &[Band], area: &Area<B>| {
            let chart = Chart {
                label,
                rate: "success rate of greedy episodes",
                range: 0.0..bands.last().map_or(1.0, |(x, _)| *x),
                curves: vec![(BLUE, bands)],
                has_dots: false,
                line: (self.target, format!("target {}", self.target)),
            };
            chart.draw(area)
        };
        chart("environment steps (thousands)", &self.over_steps, &left)?;
        chart("seconds of training", &self.over_seconds, &right)
    }
}
