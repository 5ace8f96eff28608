//! A batch of sampled transitions, in memory that is used again.

use crate::sample::columns::{Relabeled, Rows};
use crate::store::config::Dims;
use crate::store::fields::{Fields, UnknownField};
use crate::store::storage::{Storage, TransitionId};
use crate::{Sampler, Scalar};

/// Sampled transitions, column by column: each column is one contiguous row-major matrix, as
/// networks want it.
///
/// Make it once and pass it to [`Sampler::sample`](crate::Sampler::sample) again and again; its
/// memory is used again. A batch owns its numbers: nothing in it refers to the buffer.
#[derive(Clone, Debug, Default)]
pub struct Batch<T> {
    pub(crate) columns: Columns<T>,
    pub(crate) scratch: Scratch<T>,
}

/// What a batch holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Columns<T> {
    pub(crate) observation: Vec<T>,
    pub(crate) achieved_goal: Vec<T>,
    pub(crate) desired_goal: Vec<T>,
    pub(crate) action: Vec<T>,
    pub(crate) reward: Vec<T>,
    pub(crate) next_observation: Vec<T>,
    pub(crate) next_achieved_goal: Vec<T>,
    pub(crate) terminated: Vec<bool>,
    pub(crate) truncated: Vec<bool>,
    pub(crate) discount: Vec<T>,
    pub(crate) success: Vec<bool>,
    pub(crate) transition: Vec<TransitionId>,
    pub(crate) goal_source: Vec<Option<TransitionId>>,
    pub(crate) fields: Fields,
    /// The fields, one contiguous matrix after the other.
    pub(crate) field_values: Vec<T>,
    pub(crate) importance_weight: Vec<T>,
}

/// Memory for the drawing of a batch: the relabeled rows, and side by side the pairs of goals that the
/// reward function is to judge. What it holds between calls means nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scratch<T> {
    pub(crate) relabeled: Vec<Relabeled>,
    pub(crate) achieved_pairs: Vec<f64>,
    pub(crate) desired_pairs: Vec<f64>,
    pub(crate) rewards: Vec<f64>,
    pub(crate) terminated: Vec<bool>,
    /// The fields row by row, if there are several.
    pub(crate) field_rows: Vec<T>,
    /// The probabilities of the rows, but for a common factor.
    pub(crate) shares: Vec<f64>,
}

impl<T: PartialEq> PartialEq for Batch<T> {
    fn eq(&self, other: &Self) -> bool {
        self.columns == other.columns
    }
}

impl<T: Scalar> Batch<T> {
    /// An empty batch; the first sample gives it its size.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.transition.len()
    }

    /// Whether there is no row: nothing has been sampled into it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns.transition.is_empty()
    }

    /// The observations, `len * dims.observation`.
    #[must_use]
    pub fn observation(&self) -> &[T] {
        &self.columns.observation
    }

    /// The goals achieved before the step, `len * dims.goal`.
    #[must_use]
    pub fn achieved_goal(&self) -> &[T] {
        &self.columns.achieved_goal
    }

    /// The goals to pursue, `len * dims.goal`: the episode's own, or the new one where
    /// [`goal_source`](Self::goal_source) is set. It goes with the observation and with the next one.
    #[must_use]
    pub fn desired_goal(&self) -> &[T] {
        &self.columns.desired_goal
    }

    /// The actions, `len * dims.action`.
    #[must_use]
    pub fn action(&self) -> &[T] {
        &self.columns.action
    }

    /// The rewards, `len`: as stored, or computed for the new goal where there is one.
    #[must_use]
    pub fn reward(&self) -> &[T] {
        &self.columns.reward
    }

    /// The observations after the step, `len * dims.observation`.
    #[must_use]
    pub fn next_observation(&self) -> &[T] {
        &self.columns.next_observation
    }

    /// The goals achieved after the step, `len * dims.goal`.
    #[must_use]
    pub fn next_achieved_goal(&self) -> &[T] {
        &self.columns.next_achieved_goal
    }

    /// Whether the task was over after the step, `len`. Do not bootstrap there.
    #[must_use]
    pub fn terminated(&self) -> &[bool] {
        &self.columns.terminated
    }

    /// Whether the episode was cut off after the step, `len`. Bootstrap there as anywhere else.
    #[must_use]
    pub fn truncated(&self) -> &[bool] {
        &self.columns.truncated
    }

    /// What to multiply the value of the next observation with, `len`: `gamma` to the power of the steps
    /// that the window really has. Empty unless the sampler has an
    /// [`n_step`](crate::Sampler::n_step).
    #[must_use]
    pub fn discount(&self) -> &[T] {
        &self.columns.discount
    }

    /// Whether the next achieved goal counts as having reached the desired goal of the row, `len`. Empty
    /// unless the sampler's [`success`](crate::Sampler::success) is on.
    #[must_use]
    pub fn success(&self) -> &[bool] {
        &self.columns.success
    }

    /// Which transitions these are, `len`.
    #[must_use]
    pub fn transition(&self) -> &[TransitionId] {
        &self.columns.transition
    }

    /// Where each new goal comes from, `len`: the transition whose next achieved goal it is (by
    /// [`PastDesired`](crate::GoalStrategy::PastDesired), whose desired goal), or `None` for a row that
    /// was left alone. The difference of the two numbers is how many steps ahead it lies.
    #[must_use]
    pub fn goal_source(&self) -> &[Option<TransitionId>] {
        &self.columns.goal_source
    }

    /// Whether each row got a new goal, `len` of them.
    pub fn relabeled(&self) -> impl ExactSizeIterator<Item = bool> + '_ {
        self.columns.goal_source.iter().map(Option::is_some)
    }

    /// A field of the buffer's configuration, `len * field.len`; of a window of several steps, that of the
    /// first one.
    ///
    /// # Errors
    /// [`UnknownField`] if the buffer that was sampled has no such field.
    pub fn field(&self, name: &str) -> Result<&[T], UnknownField> {
        let place = self.columns.fields.place(name)?;
        Ok(&self.columns.field_values[place.start * self.len()..place.end * self.len()])
    }

    /// What to multiply each row's loss with, `len`: see [`Beta`](crate::Beta). Empty unless the sampler is
    /// [prioritized](crate::Sampler::prioritized).
    #[must_use]
    pub fn importance_weight(&self) -> &[T] {
        &self.columns.importance_weight
    }

    /// Takes all rows away.
    pub(crate) fn clear(&mut self) {
        self.resize(0, Dims { observation: 0, goal: 0, action: 0 }, false, false);
        self.columns.field_values.clear();
        self.columns.importance_weight.clear();
    }

    /// Makes room for a batch of `sampler`; what the rows hold is unspecified.
    pub(crate) fn make_room(&mut self, sampler: &Sampler, storage: &Storage<T>) -> Rows<'_, T> {
        let dims = storage.layout.dims();
        let (size, window) = (sampler.batch_size, sampler.window());
        self.resize(size, dims, sampler.n_step.is_some(), sampler.success);
        let Self { columns, scratch } = self;
        if !columns.fields.is_same(&storage.fields) {
            columns.fields = storage.fields.clone();
        }
        let n_weights = if sampler.prioritized.is_some() { size } else { 0 };
        columns.importance_weight.resize(n_weights, T::default());
        let n_fields = size * storage.layout.fields().len();
        columns.field_values.resize(n_fields, T::default());
        let fields = if storage.fields.is_plain() {
            &mut columns.field_values
        } else {
            scratch.field_rows.resize(n_fields, T::default());
            &mut scratch.field_rows
        };
        scratch.relabeled.resize(size, Relabeled::default());
        scratch.achieved_pairs.resize(size * window * dims.goal, 0.0);
        scratch.desired_pairs.resize(size * window * dims.goal, 0.0);
        Rows {
            dims,
            window,
            first: 0,
            observation: &mut columns.observation,
            achieved_goal: &mut columns.achieved_goal,
            desired_goal: &mut columns.desired_goal,
            action: &mut columns.action,
            reward: &mut columns.reward,
            next_observation: &mut columns.next_observation,
            next_achieved_goal: &mut columns.next_achieved_goal,
            terminated: &mut columns.terminated,
            truncated: &mut columns.truncated,
            discount: &mut columns.discount,
            transition: &mut columns.transition,
            goal_source: &mut columns.goal_source,
            relabeled: &mut scratch.relabeled,
            achieved_pairs: &mut scratch.achieved_pairs,
            desired_pairs: &mut scratch.desired_pairs,
            fields,
        }
    }

    /// Makes columns of the fields that were gathered row by row.
    pub(crate) fn part_fields(&mut self) {
        let Self { columns, scratch } = self;
        if columns.fields.is_plain() {
            return;
        }
        let size = columns.transition.len();
        let all = scratch.field_rows.len() / size.max(1);
        for (field, place) in columns.fields.places() {
            let column = &mut columns.field_values[place.start * size..place.end * size];
            let rows = scratch.field_rows.chunks_exact(all);
            for (to, from) in column.chunks_exact_mut(field.len).zip(rows) {
                to.copy_from_slice(&from[place.clone()]);
            }
        }
    }

    fn resize(&mut self, size: usize, dims: Dims, has_discount: bool, has_success: bool) {
        let zero = T::default();
        let columns = &mut self.columns;
        columns.observation.resize(size * dims.observation, zero);
        columns.achieved_goal.resize(size * dims.goal, zero);
        columns.desired_goal.resize(size * dims.goal, zero);
        columns.action.resize(size * dims.action, zero);
        columns.reward.resize(size, zero);
        columns.next_observation.resize(size * dims.observation, zero);
        columns.next_achieved_goal.resize(size * dims.goal, zero);
        columns.terminated.resize(size, false);
        columns.truncated.resize(size, false);
        columns.discount.resize(if has_discount { size } else { 0 }, zero);
        columns.success.resize(if has_success { size } else { 0 }, false);
        columns.transition.resize(size, TransitionId::of(0));
        columns.goal_source.resize(size, None);
    }
}
