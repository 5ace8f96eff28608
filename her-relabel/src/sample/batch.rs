//! A batch of sampled transitions, in reusable memory.

use crate::sample::columns::{Widths, columns};
use crate::sample::sampler::Sampler;
use crate::scalar::Scalar;
use crate::store::config::Dims;
use crate::store::fields::{Fields, UnknownField};
use crate::store::storage::Storage;
use crate::store::transition_id::TransitionId;

/// Sampled transitions, column by column. Each column is one contiguous row-major matrix, ready for a
/// network.
///
/// Make a batch once and pass it to [`Sampler::sample`] again and again, which reuses its memory. A batch
/// owns its numbers: nothing in it refers to the buffer.
#[derive(Clone, Debug, Default)]
pub struct Batch<T> {
    pub(crate) columns: Columns<T>,
    fields: Fields,
    /// The fields, one contiguous matrix after the other.
    field_values: Vec<T>,
    pub(crate) scratch: Scratch<T>,
    pub(crate) judged: Judged,
}

columns! { pub Batch { Columns, ColumnRows } {
    /// Returns the observations, `len * dims.observation` elements.
    observation: [T; observation] = T::default();
    /// Returns the goals achieved before the step, `len * dims.goal` elements.
    achieved_goal: [T; goal] = T::default();
    /// Returns the goals to pursue, `len * dims.goal` elements: the episode's own, or the new one where
    /// [`goal_source`](Self::goal_source) is set. They belong to both observations.
    desired_goal: [T; goal] = T::default();
    /// Returns the actions, `len * dims.action` elements.
    action: [T; action] = T::default();
    /// Returns the rewards, `len` elements: as stored, or computed for the new goal if there is one.
    reward: [T; always] = T::default();
    /// Returns the observations after the step, `len * dims.observation` elements.
    next_observation: [T; observation] = T::default();
    /// Returns the goals achieved after the step, `len * dims.goal` elements.
    next_achieved_goal: [T; goal] = T::default();
    /// Returns whether the task ended after the step, `len` elements. Do not bootstrap there.
    terminated: [bool; always] = false;
    /// Returns whether the episode was cut off after the step, `len` elements. Bootstrap as anywhere else.
    truncated: [bool; always] = false;
    /// Returns the factors of the values of the next observations, `len` elements: `gamma` to the power of
    /// the actual number of steps of the window. Empty unless the sampler has an
    /// [`n_step`](Sampler::with_n_step).
    discount: [T; n_step] = T::default();
    /// Returns whether the next achieved goal reaches the desired goal of the row, `len` elements. Empty
    /// unless the sampler computes [`success`](Sampler::with_success).
    success: [bool; success] = false;
    /// Returns the identities of the transitions, `len` elements.
    transition: [TransitionId; always] = TransitionId::of(0);
    /// Returns the source of each new goal, `len` elements: the transition whose next achieved goal it is
    /// (with [`PastDesired`](crate::GoalStrategy::PastDesired), whose desired goal), or `None` for a row that
    /// kept its goal. The difference of the two numbers is the number of steps it lies ahead.
    goal_source: [Option<TransitionId>; always] = None;
    /// Returns the factors of the rows' losses, `len` elements, which correct for non-uniform draws. Empty
    /// unless the sampler draws [by priority](Sampler::with_priorities).
    importance_weight: [T; priorities] = T::default();
} }

// Memory for drawing, without meaning between calls. The first rows of the pairs of goals are those that
// the reward function judges.
columns! { Scratch, ScratchRows {
    relabeled: [Relabeled; always] = Relabeled::default();
    achieved_pairs: [f64; goals] = 0.0;
    desired_pairs: [f64; goals] = 0.0;
    /// All fields, row by row.
    field_rows: [T; fields] = T::default();
} }

/// Memory for judging the drawn rows, without meaning between calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct Judged {
    pub(crate) rewards: Vec<f64>,
    pub(crate) terminated: Vec<bool>,
    /// The probabilities of the rows, up to a common factor.
    pub(crate) shares: Vec<f64>,
}

/// A relabeled row of a batch, and its window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Relabeled {
    pub(crate) row: usize,
    /// The number of pairs of goals: one for each step of the window.
    pub(crate) pairs: usize,
    /// The number of steps used, which is smaller if the new goal ends the task earlier.
    pub(crate) used: usize,
}

/// Some consecutive rows of a batch, to be filled, and their scratch memory.
pub(crate) struct Rows<'a, T> {
    pub(crate) widths: Widths,
    /// The place of the first row in the batch.
    pub(crate) first: usize,
    pub(crate) columns: ColumnRows<'a, T>,
    pub(crate) scratch: ScratchRows<'a, T>,
}

impl<T> Rows<'_, T> {
    pub(crate) fn len(&self) -> usize {
        self.columns.transition.len()
    }

    /// Splits the first `rows` rows from the others.
    pub(crate) fn split_at(&mut self, rows: usize) -> (Rows<'_, T>, Rows<'_, T>) {
        let (widths, first) = (self.widths, self.first);
        let columns = self.columns.split_at(rows, &widths);
        let scratch = self.scratch.split_at(rows, &widths);
        (
            Rows { widths, first, columns: columns.0, scratch: scratch.0 },
            Rows { widths, first: first + rows, columns: columns.1, scratch: scratch.1 },
        )
    }
}

impl<T: PartialEq> PartialEq for Batch<T> {
    fn eq(&self, other: &Self) -> bool {
        let Self { columns, fields, field_values, .. } = self;
        (columns, fields, field_values) == (&other.columns, &other.fields, &other.field_values)
    }
}

impl<T: Scalar> Batch<T> {
    /// Makes an empty batch, which gets its size from the first sample.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns.transition.len()
    }

    /// Returns whether there are no rows, because nothing has been sampled.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns.transition.is_empty()
    }

    /// Returns whether each row got a new goal, `len` elements.
    pub fn relabeled(&self) -> impl ExactSizeIterator<Item = bool> + '_ {
        self.columns.goal_source.iter().map(Option::is_some)
    }

    /// Returns a field of the buffer's configuration, `len * field.len` elements; of a window of several
    /// steps, that of the first step.
    ///
    /// # Errors
    /// [`UnknownField`] if the sampled buffer has no such field.
    pub fn field(&self, name: &str) -> Result<&[T], UnknownField> {
        let place = self.fields.place(name)?;
        Ok(&self.field_values[place.start * self.len()..place.end * self.len()])
    }

    /// Removes all rows.
    pub(crate) fn clear(&mut self) {
        self.columns.resize(0, &Widths::default());
        self.field_values.clear();
    }

    /// Makes room for a batch of `sampler`; the contents of the rows are unspecified.
    pub(crate) fn make_room(&mut self, sampler: &Sampler, storage: &Storage<T>) -> Rows<'_, T> {
        let Dims { observation, goal, action } = storage.layout.dims();
        let widths = Widths {
            always: 1,
            n_step: usize::from(sampler.n_step().is_some()),
            success: usize::from(sampler.success()),
            priorities: usize::from(sampler.priorities().is_some()),
            observation,
            goal,
            action,
            fields: storage.layout.fields().len(),
            goals: goal * sampler.window(),
        };
        if !self.fields.is_same(&storage.fields) {
            self.fields = storage.fields.clone();
        }
        let columns = self.columns.resize(sampler.batch_size(), &widths);
        let scratch = self.scratch.resize(sampler.batch_size(), &widths);
        Rows { widths, first: 0, columns, scratch }
    }

    /// Sorts the fields, which were gathered row by row, into one matrix each.
    pub(crate) fn separate_fields(&mut self) {
        let size = self.len();
        let (values, rows) = (&mut self.field_values, &mut self.scratch.field_rows);
        if self.fields.is_plain() {
            std::mem::swap(values, rows);
            return;
        }
        values.resize(rows.len(), T::default());
        let all = rows.len() / size.max(1);
        for (field, place) in self.fields.places() {
            let column = &mut values[place.start * size..place.end * size];
            for (to, from) in column.chunks_exact_mut(field.len).zip(rows.chunks_exact(all)) {
                to.copy_from_slice(&from[place.clone()]);
            }
        }
    }
}
