//! The lines of a learning curve's file, `curve.csv`.

use std::{ops::RangeInclusive, path::Path};

use anyhow::Context;
use baselines::learn::{Counters, CurveRow, Losses};
use her_relabel::files::read;
use serde::{
    Deserialize, Deserializer, Serialize,
    de::{DeserializeOwned, Error as _},
};

/// A line: the state of a run at an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurveLine {
    pub steps: u64,
    pub episodes: u64,
    pub discarded_episodes: u64,
    pub updates: u64,
    #[serde(deserialize_with = "seconds")]
    pub seconds: f64,
    #[serde(deserialize_with = "rate")]
    pub success_rate: f64,
    pub success_low: f64,
    pub success_high: f64,
    pub episode_return_mean: f64,
    pub final_distance_mean: f64,
    pub collected_success: Option<f64>,
    pub critic_loss: Option<f32>,
    pub actor_loss: Option<f32>,
    pub value: Option<f32>,
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

/// Returns the second of the first two evaluations in a row that reach a success rate.
pub fn reached<T>(curve: &[T], success_rate: fn(&T) -> f64, target: f64) -> Option<&T> {
    let is_reached = |pair: &&[T]| pair.iter().all(|line| success_rate(line) >= target);
    curve.windows(2).find(is_reached).map(|pair| &pair[1])
}

/// Returns lines as CSV, with a header.
pub fn csv_text(lines: impl IntoIterator<Item = impl Serialize>) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    lines.into_iter().try_for_each(|line| writer.serialize(line))?;
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// Reads the seconds of a run, which charts and means must be able to take.
pub fn seconds<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    number(deserializer, 0.0..=1e12)
}

/// Reads a success rate.
pub fn rate<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
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
pub fn read_csv<T: DeserializeOwned>(path: &Path) -> anyhow::Result<Vec<T>> {
    let broken = || format!("cannot read {}", path.display());
    let bytes = read(path, LIMIT).with_context(broken)?;
    let lines = csv::Reader::from_reader(bytes.as_slice()).into_deserialize();
    lines.collect::<Result<_, _>>().with_context(broken)
}
