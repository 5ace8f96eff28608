//! An episode as LeRobot's frames: a row for each step, with the state before it.

use std::borrow::Cow;
use std::sync::Arc;

use arrow_array::{ArrayRef, BooleanArray, Float32Array, Float64Array, Int64Array, RecordBatch};
use arrow_schema::ArrowError;
use serde_json::{Value, json};

use crate::datasets::columns::Columns;
use crate::datasets::episode::EpisodeRecord;
use crate::datasets::error::DatasetError;
use crate::datasets::metadata::Metadata;
use crate::dims::lengths_of;
use crate::policy::PolicyError;

/// A column of all frames of an episode.
pub(super) struct Feature<'a> {
    pub(super) name: &'static str,
    /// The number of elements of a row.
    pub(super) width: usize,
    elements: Elements<'a>,
}

enum Elements<'a> {
    Doubles(&'a [f64]),
    Singles(Cow<'a, [f32]>),
    Flags(Cow<'a, [bool]>),
    Counts(Vec<i64>),
}

/// Returns the columns of an episode that follows `num_episodes` others with `num_frames` frames in
/// all.
pub(super) fn features<'a>(
    episode: &'a EpisodeRecord,
    metadata: &Metadata,
    num_episodes: i64,
    num_frames: i64,
) -> Result<Vec<Feature<'a>>, DatasetError> {
    let [observation, goal, action] =
        lengths_of(&metadata.observation_space, &metadata.action_space)
            .map_err(PolicyError::from)?;
    let [qpos, qvel] = metadata.states;
    let steps = episode.rewards.len();
    let len = steps as i64;
    let feature = |name, width, elements| Feature { name, width, elements };
    // Columns of the state before each step, and of the state after it.
    let before = |name, width, column: &'a [f64]| {
        feature(name, width, Elements::Doubles(&column[..(steps * width).min(column.len())]))
    };
    let after = |name, column: &'a [f64]| {
        feature(name, 1, Elements::Doubles(column.get(1..).unwrap_or_default()))
    };
    let flags = |name, column: Cow<'a, [bool]>| feature(name, 1, Elements::Flags(column));
    let counts = |name, counts| feature(name, 1, Elements::Counts(counts));
    let done = episode.terminations.iter().zip(&episode.truncations).map(|(a, b)| *a || *b);
    let time = (0..steps).map(|step| (step as f64 / metadata.steps_per_second) as f32);
    Ok(vec![
        before("observation.state", observation, &episode.observations),
        before("observation.environment_state", goal, &episode.desired_goals),
        before("observation.achieved_goal", goal, &episode.achieved_goals),
        feature("action", action, Elements::Singles(Cow::Borrowed(&episode.actions))),
        feature("next.reward", 1, Elements::Doubles(&episode.rewards)),
        flags("next.success", episode.is_success.get(1..).unwrap_or_default().into()),
        flags("next.done", done.collect()),
        flags("next.truncated", Cow::Borrowed(&episode.truncations)),
        after("next.distance", &episode.distances),
        after("next.sparse_reward", &episode.sparse_rewards),
        after("next.dense_reward", &episode.dense_rewards),
        before("qpos", qpos, &episode.qpos),
        before("qvel", qvel, &episode.qvel),
        feature("timestamp", 1, Elements::Singles(time.collect())),
        counts("frame_index", (0..len).collect()),
        counts("episode_index", vec![num_episodes; steps]),
        counts("index", (num_frames..num_frames + len).collect()),
        counts("task_index", vec![0; steps]),
    ])
}

/// Returns the table of an episode.
pub(super) fn table(features: &[Feature<'_>], steps: usize) -> Result<RecordBatch, ArrowError> {
    let mut columns = Columns::new(steps);
    for Feature { name, width, elements } in features {
        match width {
            1 => columns.column(name, elements.array()),
            _ => columns.rows(name, elements.array())?,
        }
    }
    columns.into_table()
}

impl Feature<'_> {
    /// Describes the column for `info.json`.
    pub(super) fn describe(&self) -> Value {
        let dtype = match self.elements {
            Elements::Doubles(_) => "float64",
            Elements::Singles(_) => "float32",
            Elements::Flags(_) => "bool",
            Elements::Counts(_) => "int64",
        };
        json!({ "dtype": dtype, "shape": [self.width], "names": null })
    }

    /// Returns the elements as numbers, where true is 1.
    pub(super) fn numbers(&self) -> Cow<'_, [f64]> {
        match &self.elements {
            Elements::Doubles(elements) => Cow::Borrowed(elements),
            Elements::Singles(elements) => {
                elements.iter().map(|element| (*element).into()).collect()
            }
            Elements::Flags(elements) => {
                elements.iter().map(|flag| u8::from(*flag).into()).collect()
            }
            Elements::Counts(elements) => elements.iter().map(|count| *count as f64).collect(),
        }
    }
}

impl Elements<'_> {
    fn array(&self) -> ArrayRef {
        match self {
            Self::Doubles(elements) => Arc::new(Float64Array::from(elements.to_vec())),
            Self::Singles(elements) => Arc::new(Float32Array::from(elements.to_vec())),
            Self::Flags(elements) => Arc::new(BooleanArray::from(elements.to_vec())),
            Self::Counts(elements) => Arc::new(Int64Array::from(elements.clone())),
        }
    }
}
