//! The runs of an environment and a preset, one for each seed.

use std::{collections::BTreeMap, path::Path};

use baselines::{Estimate, learn::limits};
use fetch_env::EnvId;
use serde::{Deserialize, Serialize};

use crate::{
    shared::json::replace_file,
    train::curve_line::{CurveLine, csv_text, rate, reached, read_csv, seconds},
};

/// The runs of an environment and a preset.
pub struct Group {
    /// The environment and the preset, such as `FetchPush-v4-fast`.
    pub name: String,
    /// The success rate that ends a run when two evaluations in a row reach it.
    pub target: f64,
    /// The lines of each seed, in the order of their steps.
    runs: BTreeMap<u64, Vec<Point>>,
}

/// A point of a curve, and a line of the file.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    pub seed: u64,
    pub steps: u64,
    pub updates: u64,
    #[serde(deserialize_with = "seconds")]
    pub seconds: f64,
    #[serde(deserialize_with = "rate")]
    pub success_rate: f64,
    pub episode_return_mean: f64,
    pub final_distance_mean: f64,
}

/// The interquartile mean of all runs at a point of the horizontal axis.
pub type Band = (f64, Estimate);

impl Group {
    /// Creates a group without runs; an error if the name does not begin with an environment.
    pub fn new(name: &str) -> anyhow::Result<Self> {
        let mut parts = name.splitn(3, '-');
        let env_id = [parts.next(), parts.next()].into_iter().flatten().collect::<Vec<_>>();
        let env_id: EnvId = env_id.join("-").parse()?;
        let target = limits(env_id.task).1;
        Ok(Self { name: name.to_owned(), target, runs: BTreeMap::new() })
    }

    /// Reads the file of the group.
    pub fn read(mut self, path: &Path) -> anyhow::Result<Self> {
        for point in read_csv::<Point>(path)? {
            self.runs.entry(point.seed).or_default().push(point);
        }
        Ok(self)
    }

    /// Adds or replaces the run of a seed.
    pub fn with_run(mut self, seed: u64, lines: &[CurveLine]) -> Self {
        let point = |line: &CurveLine| {
            let &CurveLine { steps, updates, seconds, success_rate, .. } = line;
            let &CurveLine { episode_return_mean, final_distance_mean, .. } = line;
            Point {
                seed,
                steps,
                updates,
                seconds,
                success_rate,
                episode_return_mean,
                final_distance_mean,
            }
        };
        self.runs.insert(seed, lines.iter().map(point).collect());
        self
    }

    pub fn write(&self, path: &Path) -> anyhow::Result<()> {
        replace_file(path, csv_text(self.runs.values().flatten())?.as_bytes())
    }

    pub fn num_runs(&self) -> usize {
        self.runs.len()
    }

    /// Returns the second of the evaluations at which each run reached the target.
    fn reached(&self) -> Vec<Point> {
        let reached = |run| reached(run, |point: &Point| point.success_rate, self.target).copied();
        self.runs.values().filter_map(|run| reached(run)).collect()
    }

    /// Returns a line that says how many runs reached the target, and when.
    pub fn summary(&self) -> anyhow::Result<String> {
        let (reached, total) = (self.reached(), self.runs.len());
        let mut text =
            format!("{}: {} of {total} runs reached {}", self.name, reached.len(), self.target);
        let spread = |value: fn(&Point) -> f64, decimals: usize| {
            let mut values: Vec<f64> = reached.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            let [low, high] = [(values.len() - 1) / 2, values.len() / 2].map(|at| values[at]);
            let median = 0.5 * (low + high);
            let (first, last) = (values[0], values[values.len() - 1]);
            format!("median {median:.decimals$} ({first:.decimals$} to {last:.decimals$})")
        };
        if !reached.is_empty() {
            text += &format!(
                "; steps: {}; updates: {}; seconds: {}",
                spread(|point| point.steps as f64, 0),
                spread(|point| point.updates as f64, 0),
                spread(|point| point.seconds, 1),
            );
        }
        Ok(text)
    }

    /// Returns the interquartile mean of the runs at all points where one of them was evaluated.
    /// The rate of a run that has ended stays at its last value.
    pub fn bands(&self, place: fn(&Point) -> f64) -> anyhow::Result<Vec<Band>> {
        let mut places: Vec<f64> = self.runs.values().flatten().map(place).collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        let mut rests: Vec<&[Point]> = self.runs.values().map(Vec::as_slice).collect();
        let mut rates = vec![0.0; rests.len()];
        let bands = places.into_iter().map(|x| {
            for (rest, rate) in rests.iter_mut().zip(&mut rates) {
                while let Some((point, later)) = rest.split_first()
                    && place(point) <= x
                {
                    (*rate, *rest) = (point.success_rate, later);
                }
            }
            Ok((x, Estimate::interquartile_mean(&rates, 0)?))
        });
        bands.collect()
    }
}
