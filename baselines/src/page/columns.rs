//! The elements of observations and goals, plotted over the steps.

use fetch_env::GoalObservation;

use super::{
    axis::Axis,
    error::PageError,
    plot::{Ink, Plot},
};

/// The maximum number of plots of observed elements.
const MOST_PLOTS: usize = 64;

/// The maximum number of points of a line: more than a screen has pixels.
const MOST_POINTS: usize = 1000;

/// The observations of an episode, an entry for each frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    observations: Vec<Vec<f64>>,
    achieved_goals: Vec<Vec<f64>>,
    desired_goals: Vec<Vec<f64>>,
}

impl Columns {
    /// Adds a frame.
    pub(super) fn push(&mut self, observation: &impl GoalObservation) {
        let elements = observation.observation().iter();
        self.observations.push(elements.map(|&element| element.into()).collect());
        self.achieved_goals.push(observation.achieved_goal().to_vec());
        self.desired_goals.push(observation.desired_goal().to_vec());
    }

    /// Returns the plots as HTML: rewards (one for each step), distances (one for each frame),
    /// goals and observations.
    pub(super) fn html(&self, rewards: &[f64], distances: &[f64]) -> Result<String, PageError> {
        let after_steps: Vec<_> = [f64::NAN].iter().chain(rewards).copied().collect();
        let mut plots = vec![
            plot("Reward", &[(Ink::Orange, "", &after_steps)])?,
            plot("Distance to the goal", &[(Ink::Teal, "", distances)])?,
        ];
        for index in 0..len(&self.desired_goals) {
            let (achieved, desired) =
                (column(&self.achieved_goals, index), column(&self.desired_goals, index));
            let lines =
                [(Ink::Red, "desired", &desired[..]), (Ink::Blue, "achieved", &achieved[..])];
            plots.push(plot(&format!("Goal {index}"), &lines)?);
        }
        let num_columns = len(&self.observations);
        for index in 0..num_columns.min(MOST_PLOTS) {
            let values = column(&self.observations, index);
            plots.push(plot(&format!("Observation {index}"), &[(Ink::Blue, "", &values)])?);
        }
        let rest = match num_columns.checked_sub(MOST_PLOTS) {
            None | Some(0) => String::new(),
            Some(rest) => format!("<p>{rest} further elements are not plotted.</p>\n"),
        };
        let plots: String = plots.iter().map(|plot| format!("<figure>{plot}</figure>\n")).collect();
        Ok(format!("<div class=\"grid\">\n{plots}</div>\n{rest}"))
    }
}

/// Returns the number of elements of each frame.
fn len(rows: &[Vec<f64>]) -> usize {
    rows.first().map_or(0, Vec::len)
}

/// Returns an element of all frames.
fn column(rows: &[Vec<f64>], index: usize) -> Vec<f64> {
    rows.iter().map(|row| row.get(index).copied().unwrap_or(f64::NAN)).collect()
}

/// Plots lines, each with its name, over the steps. Numbers that are not finite are left out.
fn plot(title: &str, lines: &[(Ink, &str, &[f64])]) -> Result<String, PageError> {
    let all = || lines.iter().flat_map(|(_, _, values)| *values).copied().filter(|v| v.is_finite());
    let last = lines.iter().map(|(_, _, values)| values.len()).max().unwrap_or(1) - 1;
    let y = if all().next().is_some() { Axis::around("", all()) } else { Axis::new("", 0.0, 1.0) };
    let mut plot = Plot::new(title, Axis::new("step", 0.0, last as f64), y);
    for (ink, name, values) in lines {
        let points = values.iter().enumerate().step_by(values.len().div_ceil(MOST_POINTS).max(1));
        plot.line(
            *ink,
            points.filter(|(_, v)| v.is_finite()).map(|(step, value)| (step as f64, *value)),
        );
        if !name.is_empty() {
            plot.legend(*ink, name);
        }
    }
    plot.svg()
}
