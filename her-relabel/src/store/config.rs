//! The sizes of a buffer, and where things lie in a stored row.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::store::fields::Field;
use crate::store::priority_table::{NewPriority, Priorities, PriorityUnit};

/// The lengths of the vectors of a task, in elements; each at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Dims {
    /// The length of an observation (without the goals).
    pub observation: usize,
    /// The length of an achieved or a desired goal.
    pub goal: usize,
    /// The length of an action.
    pub action: usize,
}

/// The sizes of a [`HerBuffer`](crate::HerBuffer).
///
/// # Example
/// ```
/// use her_relabel::{BufferConfig, Dims};
///
/// let dims = Dims { observation: 25, goal: 3, action: 4 };
/// let config = BufferConfig::new(1_000_000, dims).with_n_envs(8).with_field("log_prob", 1);
/// assert_eq!(config.n_envs, 8);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BufferConfig {
    /// How many transitions the buffer keeps at most; at least 1.
    pub capacity: usize,
    /// The lengths of the task's vectors.
    pub dims: Dims,
    /// How many environments add to the buffer side by side; at least 1.
    pub n_envs: usize,
    /// What every transition has besides; nothing in a new configuration.
    pub fields: Vec<Field>,
    /// Priorities, for sampling by them. `None` in a new configuration.
    pub priorities: Option<Priorities>,
}

impl BufferConfig {
    /// A buffer of `capacity` transitions for one environment.
    #[must_use]
    pub const fn new(capacity: usize, dims: Dims) -> Self {
        Self { capacity, dims, n_envs: 1, fields: Vec::new(), priorities: None }
    }

    /// The same for `n_envs` environments that add side by side.
    #[must_use]
    pub const fn with_n_envs(mut self, n_envs: usize) -> Self {
        self.n_envs = n_envs;
        self
    }

    /// The same with another field for every transition, of `len` elements.
    #[must_use]
    pub fn with_field(mut self, name: impl Into<String>, len: usize) -> Self {
        self.fields.push(Field { name: name.into(), len });
        self
    }

    /// The same with priorities.
    #[must_use]
    pub const fn with_priorities(mut self, unit: PriorityUnit, new: NewPriority) -> Self {
        self.priorities = Some(Priorities { unit, new });
        self
    }
}

/// Sizes that no buffer can have.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A size is 0.
    #[error("`{name}` is 0; a buffer needs at least 1")]
    Zero {
        /// The name of the size.
        name: &'static str,
    },
    /// A field has no proper name, or that of another field.
    #[error(
        "the field name {name:?} is taken or is no name; use up to 64 ASCII letters, digits and underscores"
    )]
    FieldName {
        /// The name.
        name: String,
    },
    /// The priority of what is added is negative, NaN, infinite or enormous.
    #[error("the new priority is {priority}; use a finite number from 0 to 1e200")]
    BadPriority {
        /// The priority.
        priority: f64,
    },
    /// A row of these vectors, or the rows of `capacity` transitions, cannot be addressed.
    #[error("a buffer of these sizes exceeds the address space; check `capacity` and `dims`")]
    TooLarge,
}

/// Where things lie in a stored row.
///
/// A row is one state of an episode and what happened in it:
/// `observation | achieved_goal | action | reward | fields`. The last state of an episode has no
/// action; the episode's desired goal lies in that place, so that it costs no memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    dims: Dims,
    /// The elements of all fields.
    fields: usize,
    row: usize,
}

impl Layout {
    pub(crate) fn new<T>(config: &BufferConfig) -> Result<Self, ConfigError> {
        let dims = config.dims;
        let sizes = [
            ("capacity", config.capacity),
            ("n_envs", config.n_envs),
            ("dims.observation", dims.observation),
            ("dims.goal", dims.goal),
            ("dims.action", dims.action),
        ];
        if let Some((name, _)) = sizes.into_iter().find(|(_, size)| *size == 0) {
            return Err(ConfigError::Zero { name });
        }
        let fields =
            config.fields.iter().try_fold(0_usize, |sum, field| sum.checked_add(field.len));
        let fields = fields.ok_or(ConfigError::TooLarge)?;
        let row = row_len(dims, fields).ok_or(ConfigError::TooLarge)?;
        // Episodes of one step keep two states a transition; that is the most.
        let elements = config.capacity.checked_mul(2).and_then(|rows| rows.checked_mul(row));
        let bytes = elements.and_then(|elements| elements.checked_mul(size_of::<T>()));
        match bytes {
            Some(bytes) if bytes <= isize::MAX.unsigned_abs() => Ok(Self { dims, fields, row }),
            _ => Err(ConfigError::TooLarge),
        }
    }

    /// The elements of a row.
    pub(crate) fn row(&self) -> usize {
        self.row
    }

    pub(crate) fn dims(&self) -> Dims {
        self.dims
    }

    pub(crate) fn observation(&self) -> Range<usize> {
        0..self.dims.observation
    }

    pub(crate) fn achieved_goal(&self) -> Range<usize> {
        self.dims.observation..self.tail()
    }

    pub(crate) fn action(&self) -> Range<usize> {
        self.tail()..self.reward()
    }

    pub(crate) fn reward(&self) -> usize {
        self.tail() + self.dims.action
    }

    pub(crate) fn fields(&self) -> Range<usize> {
        self.reward() + 1..self.reward() + 1 + self.fields
    }

    /// The desired goal, in an episode's last row only.
    pub(crate) fn desired_goal(&self) -> Range<usize> {
        self.tail()..self.tail() + self.dims.goal
    }

    /// A goal: the desired one, in an episode's last row only, or the achieved one.
    #[inline(always)]
    pub(crate) fn goal(&self, is_desired: bool) -> Range<usize> {
        if is_desired { self.desired_goal() } else { self.achieved_goal() }
    }

    /// The state: what an episode's last row has too.
    pub(crate) fn state(&self) -> Range<usize> {
        0..self.tail()
    }

    /// Where the state ends.
    fn tail(&self) -> usize {
        self.dims.observation + self.dims.goal
    }
}

fn row_len(dims: Dims, fields: usize) -> Option<usize> {
    let tail = dims.action.checked_add(1)?.checked_add(fields)?.max(dims.goal);
    dims.observation.checked_add(dims.goal)?.checked_add(tail)
}
