//! The hindsight replay buffer.

mod add;
mod columns;
mod draw;
mod files;
mod own_reward;
mod settings;

use std::sync::OnceLock;

use fetch_env::FetchConfig;
use goal_reward::{DistanceReward, Symmetry};
use her_relabel::{Batch, BufferConfig, Dims, HerBuffer, TransitionId};
use pyo3::prelude::*;

use self::columns::column;
use crate::config::{ACTION_LEN, Config};
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;
use crate::integer::Integer;
use crate::mirror::EnvMirror;
use crate::task::AnyReward;

/// The environment whose transitions a buffer holds.
#[derive(FromPyObject)]
enum Kind<'py> {
    /// A Fetch task.
    Fetch(PyRef<'py, Config>),
    /// Another one, by its name and the lengths of its observations, goals and actions.
    Other((String, usize, usize, usize)),
}

impl Kind<'_> {
    fn dims(&self) -> Dims {
        match self {
            Self::Fetch(config) => Dims {
                observation: config.observation_len(),
                goal: config.goal_len(),
                action: ACTION_LEN,
            },
            Self::Other((_, observation, goal, action)) => {
                Dims { observation: *observation, goal: *goal, action: *action }
            }
        }
    }

    /// Describes the kind of transitions; see [`Config::transitions`].
    fn transitions(&self) -> String {
        match self {
            Self::Fetch(config) => config.transitions(),
            Self::Other((name, observation, goal, action)) => {
                format!("{name}, observation {observation}, goal {goal}, action {action}")
            }
        }
    }
}

/// A hindsight replay buffer of `f32`, with the rewards of an environment.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Buffer {
    contents: Exclusive<Contents>,
    /// The settings of a Fetch task.
    env: Option<FetchConfig>,
    /// Its rewards; those of other environments come from functions.
    reward: AnyReward,
    dims: Dims,
    /// The kind of transitions that the environments have.
    transitions: String,
    /// The description of the contents in a file: the same, and whose rewards relabeled rows get.
    task: String,
    /// The number of steps after which an episode is cut off, if it is known.
    episode_len: Option<usize>,
    /// The symmetries by which rows are mirrored, once they are needed.
    symmetries: OnceLock<Vec<Symmetry>>,
}

/// The transitions, and the memory of the batches.
struct Contents {
    buffer: HerBuffer<f32>,
    batch: Batch<f32>,
}

#[pymethods]
impl Buffer {
    /// `settings` are settings of the buffer as JSON, by their names. `episode_len` is the number of
    /// steps after which an episode is cut off; `has_own_reward` says whether `sample` will get a
    /// function. `mirror` says, as JSON, how another environment looks in a mirror.
    #[new]
    #[pyo3(signature = (
        kind,
        capacity,
        num_envs,
        episode_len = None,
        has_own_reward = false,
        settings = "{}",
        mirror = None,
    ))]
    fn new(
        kind: Kind<'_>,
        capacity: Integer<usize>,
        num_envs: Integer<usize>,
        episode_len: Option<usize>,
        has_own_reward: bool,
        settings: &str,
        mirror: Option<&str>,
    ) -> Result<Self> {
        let (dims, transitions) = (kind.dims(), kind.transitions());
        let own = if has_own_reward { ", relabeled by another function" } else { "" };
        let task = format!("{transitions}{own}");
        check_capacity(capacity.0, episode_len)?;
        let buffer = BufferConfig::new(capacity.0, dims).with_num_envs(num_envs.0).with_task(&task);
        let buffer = settings::with(buffer, settings)?;
        let buffer = HerBuffer::new(buffer).map_err(Error::value)?;
        let contents = Exclusive::new(Contents { buffer, batch: Batch::new() });
        let env = match &kind {
            Kind::Fetch(config) => Some(config.config.clone()),
            Kind::Other(_) => None,
        };
        let reward = match &kind {
            Kind::Fetch(config) => config.reward(),
            Kind::Other(_) => DistanceReward::sparse().into(),
        };
        let symmetries = match (mirror, &kind) {
            (None, _) => OnceLock::new(),
            (Some(mirror), Kind::Other(_)) => {
                settings::parse::<EnvMirror>("mirror", mirror)?.symmetries(dims)?.into()
            }
            (Some(_), Kind::Fetch(_)) => {
                return Err(Error::value(
                    "mirror is for the environments of other packages: give a Fetch task of your \
                     own an attribute mirror; the others need none",
                ));
            }
        };
        Ok(Self { contents, env, reward, dims, transitions, task, episode_len, symmetries })
    }

    fn __len__(&self, py: Python<'_>) -> Result<usize> {
        Ok(self.contents.lock(py)?.buffer.len())
    }

    #[getter]
    fn num_episodes(&self, py: Python<'_>) -> Result<usize> {
        Ok(self.contents.lock(py)?.buffer.num_episodes())
    }

    #[getter]
    fn capacity(&self, py: Python<'_>) -> Result<usize> {
        Ok(self.contents.lock(py)?.buffer.config().capacity())
    }

    #[getter]
    fn num_envs(&self, py: Python<'_>) -> Result<usize> {
        Ok(self.contents.lock(py)?.buffer.config().num_envs())
    }

    /// The oldest and the newest transition that can be drawn.
    #[getter]
    fn transition_ids(&self, py: Python<'_>) -> Result<Option<(u64, u64)>> {
        let ids = self.contents.lock(py)?.buffer.transition_ids();
        Ok(ids.map(|(oldest, newest)| (oldest.get(), newest.get())))
    }

    /// Sets the priorities of transitions, or of their episodes.
    fn set_priorities(
        &self,
        py: Python<'_>,
        transitions: &Bound<'_, PyAny>,
        priorities: &Bound<'_, PyAny>,
    ) -> Result<()> {
        let ids = column("transitions", transitions, "N")?;
        let id = |number: &f64| {
            let id = TransitionId::new(*number as u64).filter(|id| id.get() as f64 == *number);
            id.ok_or_else(|| {
                Error::value(format!(
                    "transitions has {number:?}: pass the column transition of a batch"
                ))
            })
        };
        let ids = ids.iter().map(id).collect::<Result<Vec<_>>>()?;
        let priorities = column("priorities", priorities, "N")?;
        Ok(self.contents.lock(py)?.buffer.set_priorities(&ids, &priorities)?)
    }

    /// The priority of a transition, or of its episode; None if it was overwritten.
    fn priority(&self, py: Python<'_>, transition: Integer<u64>) -> Result<Option<f64>> {
        let buffer = &self.contents.lock(py)?.buffer;
        Ok(TransitionId::new(transition.0).and_then(|id| buffer.priority(id)))
    }

    /// Removes all transitions.
    fn clear(&self, py: Python<'_>) -> Result<()> {
        self.contents.lock(py)?.buffer.clear();
        Ok(())
    }

    /// Raises an error if environments of a kind have transitions of another kind.
    fn check_kind(&self, kind: Kind<'_>) -> Result<()> {
        self.check_transitions(&kind.transitions())
    }

    /// The kind of transitions that it holds.
    #[getter]
    fn task(&self) -> &str {
        &self.task
    }
}

impl Buffer {
    fn check_transitions(&self, theirs: &str) -> Result<()> {
        let ours = &self.transitions;
        if theirs == ours {
            return Ok(());
        }
        Err(Error::value(format!(
            "the environments have transitions of another kind ({theirs}) than the buffer \
             ({ours}): use a buffer that was made for them"
        )))
    }
}

/// Checks that a whole episode fits: of a longer one, only the last steps would be kept.
fn check_capacity(capacity: usize, episode_len: Option<usize>) -> Result<()> {
    match episode_len.filter(|steps| capacity < *steps) {
        None => Ok(()),
        Some(steps) => Err(Error::value(format!(
            "the capacity is {capacity} transitions, but an episode has up to {steps} steps: pass \
             at least {steps}"
        ))),
    }
}
