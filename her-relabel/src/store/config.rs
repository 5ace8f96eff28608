//! The configuration of a buffer, and its checks.

use std::collections::BTreeSet;

use goal_reward::Dims;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::store::fields::{Field, MAX_NAME};
use crate::store::motionless::MotionlessEpisodes;
use crate::store::priorities::{NewPriority, Priorities, is_priority};

/// Settings of a [`HerBuffer`](crate::HerBuffer), checked by
/// [`HerBuffer::new`](crate::HerBuffer::new).
///
/// # Example
/// ```
/// use her_relabel::{BufferConfig, Dims};
///
/// let dims = Dims { observation: 25, goal: 3, action: 4 };
/// let config = BufferConfig::new(1_000_000, dims).with_num_envs(8).with_field("log_prob", 1);
/// assert_eq!(config.num_envs(), 8);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BufferConfig {
    capacity: usize,
    dims: Dims,
    num_envs: usize,
    fields: Vec<Field>,
    priorities: Option<Priorities>,
    motionless_episodes: Option<MotionlessEpisodes>,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    task: String,
}

/// The maximal length of a task's description, in bytes.
pub(crate) const MAX_TASK: usize = 8192;

impl BufferConfig {
    /// Creates settings of a buffer that keeps up to `capacity` transitions, at least 1, with
    /// vectors of the lengths `dims`.
    #[must_use]
    pub const fn new(capacity: usize, dims: Dims) -> Self {
        Self {
            capacity,
            dims,
            num_envs: 1,
            fields: Vec::new(),
            priorities: None,
            motionless_episodes: None,
            task: String::new(),
        }
    }

    /// Adds a [`Field`] of `len` elements to every transition. There are none by default, because
    /// each takes memory.
    #[must_use]
    pub fn with_field(mut self, name: impl Into<String>, len: usize) -> Self {
        self.fields.push(Field { name: name.into(), len });
        self
    }

    /// Sets the priorities to sample by. The default is `None`, because they take memory and only
    /// [prioritized](crate::Sampler::with_priorities) samplers use them.
    #[must_use]
    pub fn with_priorities(mut self, priorities: impl Into<Option<Priorities>>) -> Self {
        self.priorities = priorities.into();
        self
    }

    /// Sets the share of motionless episodes that is kept. The default is `None`: all are kept,
    /// because leaving some out is a bias.
    #[must_use]
    pub fn with_motionless_episodes(
        mut self,
        motionless_episodes: impl Into<Option<MotionlessEpisodes>>,
    ) -> Self {
        self.motionless_episodes = motionless_episodes.into();
        self
    }

    /// Describes the task whose transitions the buffer holds, in up to 8,192 bytes: its name, its
    /// reward, and whatever else makes transitions of another kind. Nothing by default.
    ///
    /// A file keeps the description, so that the program that [loads](crate::HerBuffer::load) it can
    /// compare [`task`](Self::task) with its own; [`append`](crate::HerBuffer::append) does.
    #[must_use]
    pub fn with_task(mut self, task: impl Into<String>) -> Self {
        self.task = task.into();
        self
    }

    /// Returns the description of the task; empty if there is none.
    #[must_use]
    pub fn task(&self) -> &str {
        &self.task
    }

    settings! {
        /// Sets the number of environments that add to the buffer side by side, at least 1. The
        /// default is 1.
        with_num_envs(num_envs: usize);

        /// Returns the largest number of transitions that the buffer keeps.
        capacity: usize;
        /// Returns the lengths of the task's vectors.
        dims: Dims;
        /// Returns the number of environments that add to the buffer side by side.
        num_envs: usize;
        /// Returns the priorities to sample by.
        priorities: Option<Priorities>;
        /// Returns the share of motionless episodes that is kept.
        motionless_episodes: Option<MotionlessEpisodes>;
    }

    /// Returns the additional fields of every transition.
    #[must_use]
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// Checks all settings except the size of the memory, which depends on the element type.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let Dims { observation, goal, action } = self.dims;
        let sizes = [
            ("capacity", self.capacity),
            ("num_envs", self.num_envs),
            ("dims.observation", observation),
            ("dims.goal", goal),
            ("dims.action", action),
        ];
        let lens = self.fields.iter().map(|field| ("fields.len", field.len));
        if let Some((name, _)) = sizes.into_iter().chain(lens).find(|(_, size)| *size == 0) {
            return Err(ConfigError::Zero { name });
        }
        if self.task.len() > MAX_TASK {
            return Err(ConfigError::TaskTooLong { len: self.task.len() });
        }
        let mut names = BTreeSet::new();
        for name in self.fields.iter().map(|field| &field.name) {
            let is_plain = name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
            if !(is_plain && (1..=MAX_NAME).contains(&name.len()) && names.insert(name)) {
                return Err(ConfigError::FieldName { name: name.clone() });
            }
        }
        if let Some(motionless) =
            self.motionless_episodes.filter(|motionless| !motionless.is_valid())
        {
            return Err(ConfigError::BadDistance { distance: motionless.max_distance() });
        }
        match self.priorities.map(|settings| settings.new_priority()) {
            Some(NewPriority::Given(priority)) if !is_priority(priority) => {
                Err(ConfigError::BadPriority { priority })
            }
            _ => Ok(()),
        }
    }
}

/// Error returned for invalid settings.
#[derive(Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A size is 0.
    #[error("`{name}` is 0: set it to at least 1")]
    Zero {
        /// The name of the size.
        name: &'static str,
    },
    /// A field has an invalid name, or the name of another field.
    #[error(
        "the field name {name:?} is invalid or taken: use up to 64 ASCII letters, digits and \
         underscores, and each name once"
    )]
    FieldName {
        /// The name.
        name: String,
    },
    /// The description of the task is too long.
    #[error("the description of the task has {len} bytes: use at most {MAX_TASK}")]
    TaskTooLong {
        /// Its length in bytes.
        len: usize,
    },
    /// The priority of new transitions is negative, NaN, infinite or enormous.
    #[error("the new priority is {priority}: use a finite number from 0 to 1e200")]
    BadPriority {
        /// The priority.
        priority: f64,
    },
    /// The distance of motionless episodes is negative, NaN or infinite.
    #[error("the distance of motionless episodes is {distance}: use a finite number, at least 0")]
    BadDistance {
        /// The distance.
        distance: f64,
    },
    /// The rows of `capacity` transitions cannot be addressed, or there is no memory for this
    /// number of environments.
    #[error("there is no memory for these sizes: reduce `capacity`, `dims` or `num_envs`")]
    TooLarge,
}
debug_as_display!(ConfigError);
