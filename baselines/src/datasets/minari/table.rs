//! An episode as an Arrow table in Minari's layout: a row for each state.

use arrow_array::{BooleanArray, Float32Array, Float64Array, RecordBatch, UInt8Array};
use arrow_schema::ArrowError;

use super::columns::Columns;
use crate::datasets::episode::EpisodeRecord;

/// Returns the table of an episode. Its last row has the last state, and no step.
pub(super) fn table(
    episode: &EpisodeRecord,
    has_snapshots: bool,
) -> Result<RecordBatch, ArrowError> {
    let states = episode.rewards.len() + 1;
    let doubles = |values: &[f64]| Float64Array::from(values.to_vec());
    let mut observations = Columns::new(states);
    observations.rows("observation", doubles(&episode.observations))?;
    observations.rows("achieved_goal", doubles(&episode.achieved_goals))?;
    observations.rows("desired_goal", doubles(&episode.desired_goals))?;
    let mut infos = Columns::new(states);
    // A number, as Python environments return it.
    let success = episode.is_success.iter().map(|success| f32::from(u8::from(*success)));
    // Rows of one number, because Minari cannot read its own copies of plain numbers.
    infos.shaped_rows("is_success", Float32Array::from_iter_values(success))?;
    infos.shaped_rows("distance", doubles(&episode.distances))?;
    infos.shaped_rows("sparse_reward", doubles(&episode.sparse_rewards))?;
    infos.shaped_rows("dense_reward", doubles(&episode.dense_rewards))?;
    infos.shaped_rows("qpos", doubles(&episode.qpos))?;
    infos.shaped_rows("qvel", doubles(&episode.qvel))?;
    if has_snapshots {
        infos.shaped_rows("snapshot", snapshots(episode)?)?;
    }
    let mut table = Columns::new(states);
    table.column("observations", observations.into_struct()?);
    table.rows("actions", Float32Array::from(padded(&episode.actions, states)))?;
    table.column("rewards", Float64Array::from(padded(&episode.rewards, states)));
    table.column("terminations", BooleanArray::from(padded(&episode.terminations, states)));
    table.column("truncations", BooleanArray::from(padded(&episode.truncations, states)));
    table.column("infos", infos.into_struct()?);
    table.into_table()
}

/// Returns the snapshots inside the time limit as JSON, padded with spaces to the longest.
fn snapshots(episode: &EpisodeRecord) -> Result<UInt8Array, ArrowError> {
    let texts = episode.snapshots.iter().map(|snapshot| serde_json::to_vec(snapshot.inner()));
    let mut texts = texts
        .collect::<Result<Vec<_>, _>>()
        .map_err(|error| ArrowError::ExternalError(error.into()))?;
    let longest = texts.iter().map(Vec::len).max().unwrap_or_default();
    texts.iter_mut().for_each(|text| text.resize(longest, b' '));
    Ok(texts.concat().into())
}

/// Returns the rows of the steps and one row of zeros, which Minari ignores.
fn padded<T: Copy + Default>(rows: &[T], states: usize) -> Vec<T> {
    let width = rows.len().checked_div(states - 1).unwrap_or_default();
    let mut padded = rows.to_vec();
    padded.resize(states * width, T::default());
    padded
}
