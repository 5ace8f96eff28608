//! The layout of a stored row.

use std::ops::Range;

use goal_reward::Dims;

use crate::store::config::{BufferConfig, ConfigError};

/// The places of a stored row's parts.
///
/// A row is one state of an episode and the step that follows it:
/// `observation | achieved_goal | action | reward | fields`. The last state of an episode has no
/// action; the episode's desired goal lies in its place and so costs no memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    dims: Dims,
    /// The number of elements of all fields.
    fields: usize,
    row: usize,
}

impl Layout {
    /// Creates the layout of rows of `T`, if the rows of a full buffer can be addressed.
    pub(crate) fn new<T>(config: &BufferConfig) -> Result<Self, ConfigError> {
        let dims = config.dims();
        let sizes = || {
            let mut lens = config.fields().iter().map(|field| field.len);
            let fields = lens.try_fold(0, usize::checked_add)?;
            let tail = dims.action.checked_add(1)?.checked_add(fields)?.max(dims.goal);
            let row = dims.observation.checked_add(dims.goal)?.checked_add(tail)?;
            // Episodes of one step keep two states per transition, which is the most.
            let elements = config.capacity().checked_mul(2)?.checked_mul(row)?;
            let bytes = elements.checked_mul(size_of::<T>())?;
            (bytes <= isize::MAX.unsigned_abs()).then_some(Self { dims, fields, row })
        };
        sizes().ok_or(ConfigError::TooLarge)
    }

    /// Returns the number of elements of a row.
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

    /// Returns the desired goal, which only an episode's last row has.
    pub(crate) fn desired_goal(&self) -> Range<usize> {
        self.tail()..self.tail() + self.dims.goal
    }

    /// Returns the desired goal, which only an episode's last row has, or the achieved goal.
    #[inline(always)]
    pub(crate) fn goal(&self, is_desired: bool) -> Range<usize> {
        if is_desired { self.desired_goal() } else { self.achieved_goal() }
    }

    /// Returns the state, which every row has.
    pub(crate) fn state(&self) -> Range<usize> {
        0..self.tail()
    }

    /// Returns the end of the state.
    fn tail(&self) -> usize {
        self.dims.observation + self.dims.goal
    }
}
