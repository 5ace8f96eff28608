//! The lines of a learning curve's file, `curve.csv`.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;
use std::path::Path;
use std::{io, iter};

use her_relabel::files::read;
use serde::{
    Deserialize, Deserializer, Serialize,
    de::{DeserializeOwned, Error as _},
};

use super::error::FolderError;
use crate::learn::{Counters, CurveRow, Evaluated, Losses};

/// A line of a run's `curve.csv`: its state at an evaluation, as [`CurveRow`] has it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CurveLine {
    /// The number of steps of all environments.
    pub steps: u64,
    /// The number of finished episodes.
    pub episodes: u64,
    /// The number of episodes discarded because their environment failed.
    pub discarded_episodes: u64,
    /// The number of updates.
    pub updates: u64,
    /// The time spent collecting and updating, in seconds, to the millisecond.
    #[serde(deserialize_with = "seconds")]
    pub seconds: f64,
    /// The share of the greedy policy's episodes whose last step was a success.
    #[serde(deserialize_with = "rate")]
    pub success_rate: f64,
    /// The lower end of its 95 % confidence interval.
    pub success_low: f64,
    /// The upper end.
    pub success_high: f64,
    /// The mean sum of rewards of these episodes.
    pub episode_return_mean: f64,
    /// Their mean distance from the goal after the last step, in meters.
    pub final_distance_mean: f64,
    /// The success rate of the episodes collected since the last evaluation.
    pub collected_success: Option<f64>,
    /// The mean loss of the critic since then.
    pub critic_loss: Option<f32>,
    /// The mean loss of the actor.
    pub actor_loss: Option<f32>,
    /// The mean value that the critic gives the actor's actions.
    pub value: Option<f32>,
}

impl Evaluated for CurveLine {
    fn success_rate(&self) -> f64 {
        self.success_rate
    }
}

impl From<&CurveRow> for CurveLine {
    fn from(row: &CurveRow) -> Self {
        let Counters { steps, episodes, discarded_episodes, updates, seconds, .. } = row.counters;
        let loss = |loss: fn(&Losses) -> f32| row.losses.as_ref().map(loss);
        Self {
            steps,
            episodes,
            discarded_episodes,
            updates,
            seconds: (seconds * 1e3).round() / 1e3,
            success_rate: row.success_rate.value,
            success_low: (row.success_rate.low * 1e4).round() / 1e4,
            success_high: (row.success_rate.high * 1e4).round() / 1e4,
            episode_return_mean: row.episode_return_mean,
            final_distance_mean: row.final_distance_mean,
            collected_success: row.collected_success,
            critic_loss: loss(|losses| losses.critic),
            actor_loss: loss(|losses| losses.actor),
            value: loss(|losses| losses.value),
        }
    }
}

/// Returns a learning curve as CSV: the contents of a run's `curve.csv`, with the columns of
/// [`CurveLine`] and then those of all [diagnostics](CurveRow::diagnostics), empty where a row has
/// none.
///
/// # Errors
/// None that is known: rows are numbers.
pub fn curve_csv(rows: &[CurveRow]) -> io::Result<Vec<u8>> {
    let lines = csv_bytes(rows.iter().map(CurveLine::from))?;
    let names = diagnostic_names(rows);
    let header = names.iter().map(|name| (*name).to_owned()).collect();
    let cell = |row: &CurveRow, name| row.diagnostics.get(name).map(f32::to_string);
    let cells = rows.iter().map(|row| {
        names.iter().map(|name| cell(row, *name).unwrap_or_default()).collect::<Vec<_>>()
    });
    let mut lines = csv::ReaderBuilder::new().has_headers(false).from_reader(lines.as_slice());
    let mut writer = csv::Writer::from_writer(Vec::new());
    for (line, cells) in lines.records().zip(iter::once(header).chain(cells)) {
        let mut line = line?;
        line.extend(cells);
        writer.write_record(&line)?;
    }
    writer.into_inner().map_err(|error| error.into_error())
}

/// Returns the names of the diagnostics of any row.
pub(super) fn diagnostic_names(rows: &[CurveRow]) -> BTreeSet<&str> {
    rows.iter().flat_map(|row| row.diagnostics.keys()).map(String::as_str).collect()
}

/// Returns lines as CSV, with a header.
pub(super) fn csv_bytes(lines: impl IntoIterator<Item = impl Serialize>) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut writer = csv::Writer::from_writer(&mut bytes);
    lines.into_iter().try_for_each(|line| writer.serialize(line))?;
    writer.flush()?;
    drop(writer);
    Ok(bytes)
}

/// Reads the seconds of a run, which charts and means must be able to take.
pub(super) fn seconds<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    number(deserializer, 0.0..=1e12)
}

/// Reads a success rate.
pub(super) fn rate<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    number(deserializer, 0.0..=1.0)
}

fn number<'de, D: Deserializer<'de>>(
    deserializer: D,
    range: RangeInclusive<f64>,
) -> Result<f64, D::Error> {
    let number = f64::deserialize(deserializer)?;
    if range.contains(&number) {
        return Ok(number);
    }
    let (least, most) = range.into_inner();
    Err(D::Error::custom(format_args!("{number} is not a number from {least} to {most}")))
}

/// The largest size of a file of lines, in bytes.
const LIMIT: u64 = 4 << 20;

/// Reads lines.
pub(super) fn read_csv<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, FolderError> {
    let bytes = read(path, LIMIT).map_err(FolderError::file("read", path))?;
    let lines = csv::Reader::from_reader(bytes.as_slice()).into_deserialize();
    let lines: Result<_, _> = lines.collect();
    lines.map_err(|source| FolderError::Csv { path: path.to_owned(), source })
}
