//! Reads a Minari data set into a replay buffer.

use std::path::{Path, PathBuf};

use her_relabel::{Dims, EpisodeData, HerBuffer, Scalar, files};
use serde::Deserialize;

use super::arrow::{ArrowFile, Fault};
use super::error::MinariError;

/// The part of a data set's metadata that is read.
#[derive(Deserialize)]
struct Metadata {
    total_episodes: u64,
    data_format: String,
}

/// The largest file of an episode that is read into memory.
const MOST_BYTES: u64 = 1 << 32;

/// Adds all episodes of a Minari data set, in order, to a buffer without fields, and returns how
/// many were added.
///
/// The data set is in Minari's Arrow format, written by a
/// [`MinariWriter`](crate::datasets::MinariWriter) or by Minari itself, and its observations are a
/// dictionary of `observation`, `achieved_goal` and `desired_goal`, all in single or double
/// precision. Rewards are those of the data set.
///
/// The goal of a step is the desired goal of the state that it leads to, which its reward is for.
/// An episode of a buffer has one goal and ends once, so an episode of the data set becomes several
/// if its goal changes, or if it continues after a step that terminated or truncated it. An episode
/// that just stops counts as truncated.
///
/// An import takes no more memory than another buffer like this one and a few times the file of an
/// episode, whatever sizes that file claims. The files are regular ones of at most 4 GiB.
///
/// # Errors
/// [`MinariError`]; then no episode has been added.
///
/// ```no_run
/// use baselines::{buffer_config, datasets::import_minari};
/// use her_relabel::HerBuffer;
///
/// let config = buffer_config(1_000_000, &fetch_env::make("FetchPush-v4")?)?;
/// let mut buffer = HerBuffer::<f32>::new(config)?;
/// import_minari(&mut buffer, "minari/fetch/push/expert-v0")?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn import_minari<T: Scalar>(
    buffer: &mut HerBuffer<T>,
    folder: impl AsRef<Path>,
) -> Result<u64, MinariError> {
    let data = folder.as_ref().join("data");
    let path = data.join("metadata.json");
    let json = read(&path)?;
    let metadata = serde_json::from_slice(&json);
    let Metadata { total_episodes, data_format } =
        metadata.map_err(|source| MinariError::Metadata { path, source })?;
    if data_format != "arrow" {
        return Err(MinariError::Format { format: data_format });
    }
    let config = buffer.config().clone().with_num_envs(1).with_priorities(None);
    let mut staged = HerBuffer::<T>::new(config)?;
    let mut added = 0;
    for episode in 0..total_episodes {
        let path = data.join(episode.to_string()).join("part-0.arrow");
        let columns = Columns::read(path, buffer.config().dims())?;
        added += columns.add_to(&mut staged, episode)?;
    }
    // The other buffer has the same rows.
    let refused = |source| MinariError::Episode { episode: total_episodes, source };
    buffer.append(&staged).map_err(refused)?;
    Ok(added)
}

fn read(path: &Path) -> Result<Vec<u8>, MinariError> {
    files::read(path, MOST_BYTES)
        .map_err(|source| MinariError::File { path: path.to_owned(), source })
}

/// An episode of a data set: a row for each state, where the step of the last row is ignored.
struct Columns {
    dims: Dims,
    observations: Vec<f64>,
    achieved_goals: Vec<f64>,
    desired_goals: Vec<f64>,
    actions: Vec<f64>,
    rewards: Vec<f64>,
    terminations: Vec<bool>,
    truncations: Vec<bool>,
}

impl Columns {
    fn read(path: PathBuf, dims: Dims) -> Result<Self, MinariError> {
        let bytes = read(&path)?;
        let fault = |fault, names: &[&str], expected| {
            let (path, column) = (path.clone(), names.join("/"));
            match fault {
                Fault::File(problem) => MinariError::Arrow { path, problem },
                Fault::Missing => MinariError::Missing { path, column },
                Fault::Type { expected } => MinariError::Type { path, column, expected },
                Fault::Width { actual } => MinariError::Width { path, column, actual, expected },
            }
        };
        let file = ArrowFile::open(&bytes).map_err(|error| fault(error, &[], 0))?;
        let floats = |names: &[&str], width| {
            file.floats(names, width).map_err(|error| fault(error, names, width))
        };
        let flags = |name| file.flags(&[name]).map_err(|error| fault(error, &[name], 1));
        let Dims { observation, goal, action } = dims;
        Ok(Self {
            dims,
            observations: floats(&["observations", "observation"], observation)?,
            achieved_goals: floats(&["observations", "achieved_goal"], goal)?,
            desired_goals: floats(&["observations", "desired_goal"], goal)?,
            actions: floats(&["actions"], action)?,
            rewards: floats(&["rewards"], 1)?,
            terminations: flags("terminations")?,
            truncations: flags("truncations")?,
        })
    }

    /// Adds the steps as one episode or several, and returns how many.
    fn add_to<T: Scalar>(
        &self,
        buffer: &mut HerBuffer<T>,
        episode: u64,
    ) -> Result<u64, MinariError> {
        let Dims { observation, goal, action } = self.dims;
        let goal_of = |step: usize| &self.desired_goals[(step + 1) * goal..(step + 2) * goal];
        let steps = self.rewards.len().saturating_sub(1);
        let (mut start, mut added) = (0, 0);
        for step in 0..steps {
            let (terminated, truncated) = (self.terminations[step], self.truncations[step]);
            let goes_on = step + 1 < steps && goal_of(step) == goal_of(step + 1);
            if goes_on && !terminated && !truncated {
                continue;
            }
            let end = step + 1;
            let data = EpisodeData {
                observation: &self.observations[start * observation..(end + 1) * observation],
                achieved_goal: &self.achieved_goals[start * goal..(end + 1) * goal],
                desired_goal: goal_of(step),
                action: &self.actions[start * action..end * action],
                reward: &self.rewards[start..end],
                terminated,
                truncated: truncated || !terminated,
                fields: &[],
            };
            buffer.add_episode(&data).map_err(|source| MinariError::Episode { episode, source })?;
            (start, added) = (end, added + 1);
        }
        Ok(added)
    }
}
