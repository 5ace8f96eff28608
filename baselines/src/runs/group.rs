//! The runs of an environment and a preset, one for each seed.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use fetch_env::{EnvId, MakeError};
use her_relabel::files::replace_entry;
use serde::{Deserialize, Serialize};

use super::curve::{CurveLine, csv_bytes, rate, read_csv, seconds};
use super::error::FolderError;
use super::plan::target_of;
use crate::learn::{Evaluated, limits};
use crate::statistics::{Estimate, StatisticsError};

/// The runs of an environment and a preset, with their [name](super::RunDescription::group).
#[derive(Clone, Debug)]
pub struct Group {
    name: String,
    /// The success rate that ends a run when two evaluations in a row reach it.
    target: f64,
    /// The lines of each seed, in the order of their steps.
    runs: BTreeMap<u64, Vec<Point>>,
}

/// A point of a curve, and a line of the file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Point {
    /// The seed of the run.
    pub seed: u64,
    /// The number of steps.
    pub steps: u64,
    /// The number of updates.
    pub updates: u64,
    /// The seconds of training.
    #[serde(deserialize_with = "seconds")]
    pub seconds: f64,
    /// The success rate of the greedy policy.
    #[serde(deserialize_with = "rate")]
    pub success_rate: f64,
    /// Its mean return.
    pub episode_return_mean: f64,
    /// Its mean distance from the goal at the end, in meters.
    pub final_distance_mean: f64,
}

impl Evaluated for Point {
    fn success_rate(&self) -> f64 {
        self.success_rate
    }
}

/// The interquartile mean of all runs at a point of the horizontal axis.
pub type Band = (f64, Estimate);

impl Group {
    /// Creates a group without runs.
    ///
    /// # Errors
    /// [`MakeError::UnknownId`] if the name does not begin with an environment.
    pub fn new(name: &str) -> Result<Self, MakeError> {
        let mut parts = name.splitn(3, '-');
        let env_id = [parts.next(), parts.next()].into_iter().flatten().collect::<Vec<_>>();
        let env_id: EnvId = env_id.join("-").parse()?;
        let target = limits(env_id.task).1;
        Ok(Self { name: name.to_owned(), target, runs: BTreeMap::new() })
    }

    /// Reads the file of the group.
    ///
    /// # Errors
    /// [`FolderError`] if the file cannot be read, or has no curves.
    pub fn read(mut self, path: impl AsRef<Path>) -> Result<Self, FolderError> {
        for point in read_csv::<Point>(path.as_ref())? {
            self.runs.entry(point.seed).or_default().push(point);
        }
        Ok(self)
    }

    /// Adds or replaces the run of a seed.
    #[must_use]
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

    /// Writes the file of the group, which appears whole or not at all.
    ///
    /// # Errors
    /// [`FolderError`] if the file system fails.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), FolderError> {
        let path = path.as_ref();
        let csv =
            csv_bytes(self.runs.values().flatten()).map_err(FolderError::file("write", path))?;
        replace_entry(path, |file| file.write_all(&csv)).map_err(FolderError::file("write", path))
    }

    /// Returns the environment and the preset, such as `FetchPush-v4-fast`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the success rate that ends a run when two evaluations in a row reach it.
    #[must_use]
    pub const fn target(&self) -> f64 {
        self.target
    }

    /// Returns the number of runs.
    #[must_use]
    pub fn num_runs(&self) -> usize {
        self.runs.len()
    }

    /// Returns the evaluation at which each run reached the target.
    fn reached(&self) -> Vec<Point> {
        let target = target_of(self.target);
        self.runs.values().filter_map(|run| target.first_reached(run).copied()).collect()
    }

    /// Returns a line that says how many runs reached the target, and when.
    #[must_use]
    pub fn summary(&self) -> String {
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
        text
    }

    /// Returns the interquartile mean of the runs at all points where one of them was evaluated.
    /// The rate of a run that has ended stays at its last value.
    ///
    /// # Errors
    /// [`StatisticsError`] if the group has no run.
    pub fn bands(&self, place: fn(&Point) -> f64) -> Result<Vec<Band>, StatisticsError> {
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
