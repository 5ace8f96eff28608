//! A batch of sampled transitions, in reusable memory.

use crate::sample::error::SampleError;
use crate::sample::rows::columns::{Widths, column_table, resize};
use crate::scalar::Scalar;
use crate::store::fields::{Fields, UnknownField};
use crate::store::transition_id::TransitionId;

/// Sampled transitions, column by column. Each column is one contiguous row-major matrix, ready for
/// a network.
///
/// Create a batch once and pass it to [`Sampler::sample`](crate::Sampler::sample) again and again,
/// which reuses its memory. `T` is the type of the network, `f32` or `f64`, and need not be that of
/// the buffer: an `f32` batch of an `f64` buffer has the nearest `f32` numbers (infinite beyond its
/// range, except rewards), and its rewards are computed from the buffer's own numbers.
///
/// To pass columns to a tensor library that takes vectors, without a copy, see
/// [`take_columns`](Self::take_columns). To draw into your own memory, see
/// [`Sampler::sample_into`](crate::Sampler::sample_into).
#[derive(Clone, Debug, Default)]
pub struct Batch<T> {
    pub(crate) columns: Columns<T>,
    /// The number of rows, which remains when the columns are taken.
    pub(crate) len: usize,
    fields: Fields,
    /// The fields, one contiguous matrix after the other.
    field_values: Vec<T>,
    pub(crate) scratch: Scratch<T>,
    pub(crate) workspace: Workspace,
}

column_table! { Batch: {
    /// The columns of a [`Batch`], owned: see [`Batch::take_columns`].
    pub struct Columns;
    /// Caller-provided buffers for columns of a [`Batch`], for
    /// [`Sampler::sample_into`](crate::Sampler::sample_into). A column without a buffer stays in
    /// the batch; [`Default`] provides none.
    pub struct ColumnsMut;
} {
    observation: [T; observation] = T::default(),
        "observations, `len * dims.observation` elements. Empty if they are \
        [joined with the goals](crate::Sampler::with_joined_goal).";
    achieved_goal: [T; goal] = T::default(),
        "goals achieved before the step, `len * dims.goal` elements.";
    desired_goal: [T; goal] = T::default(),
        "goals to pursue, `len * dims.goal` elements: the episode's own, or the new one where \
        `goal_source` is set. They belong to both observations.";
    action: [T; action] = T::default(),
        "actions, `len * dims.action` elements.";
    reward: [T; always] = T::default(),
        "rewards, `len` elements: as stored, or computed for the new goal if there is one.";
    next_observation: [T; observation] = T::default(),
        "observations after the step, `len * dims.observation` elements. Empty if they are \
        [joined with the goals](crate::Sampler::with_joined_goal).";
    next_achieved_goal: [T; goal] = T::default(),
        "goals achieved after the step, `len * dims.goal` elements.";
    input: [T; input] = T::default(),
        "observations, each followed by [a goal](crate::JoinedGoal), \
        `len * (dims.observation + dims.goal)` elements. Empty unless the sampler \
        [joins them](crate::Sampler::with_joined_goal).";
    next_input: [T; input] = T::default(),
        "observations after the step, each followed by [a goal](crate::JoinedGoal), \
        `len * (dims.observation + dims.goal)` elements. Empty unless the sampler \
        [joins them](crate::Sampler::with_joined_goal).";
    terminated: [bool; always] = false,
        "termination flags, `len` elements: whether the task ended after the step. Do not \
        bootstrap there.";
    truncated: [bool; always] = false,
        "truncation flags, `len` elements: whether the episode was cut off after the step. \
        Bootstrap as anywhere else.";
    discount: [T; discount] = T::default(),
        "factors of the values of the next observations, `len` elements: `gamma` to the power of \
        the actual number of steps of the row, and 0 where the task ended. Nothing else is needed \
        to bootstrap: the target is `reward + discount * value`. Empty unless the sampler has a \
        [discount](crate::Sampler::with_discount) or [windows](crate::Sampler::with_n_step).";
    success: [bool; success] = false,
        "success flags, `len` elements: whether the next achieved goal reaches the desired goal of \
        the row. Empty unless the sampler computes [success](crate::Sampler::with_success).";
    transition: [TransitionId; always] = TransitionId::of(0),
        "identities of the transitions, `len` elements.";
    goal_source: [Option<TransitionId>; always] = None,
        "source of each new goal, `len` elements: the transition whose next achieved goal it is \
        (with [PastDesired](crate::GoalStrategy::PastDesired), whose desired goal), or `None` for \
        a row that kept its goal. The source's number minus that of the row's transition is the \
        number of steps it lies ahead.";
    importance_weight: [T; priorities] = T::default(),
        "factors of the rows' losses, `len` elements, which correct for non-uniform draws. Empty \
        unless the sampler draws [by priority](crate::Sampler::with_priorities).";
} }

column_table! { {
    /// Memory for drawing, with unspecified contents between calls.
    pub(crate) struct Scratch;
    /// Some rows of [`Scratch`].
    pub(crate) struct ScratchRows;
} {
    relabeled: [Relabeled; always] = Relabeled::default(),
        "relabeled rows, at the front.";
    achieved_pairs: [f64; goals] = 0.0,
        "achieved goals that the reward function judges, at the front.";
    desired_pairs: [f64; goals] = 0.0,
        "desired goals of the same pairs.";
    judged_achieved: [f64; judged] = 0.0,
        "achieved goals whose success is judged, if no column holds them as they are stored.";
    judged_desired: [f64; judged] = 0.0,
        "goals for which their success is judged.";
    field_rows: [T; fields] = T::default(),
        "fields, row by row.";
    mirrored: [f64; mirrored] = 0.0,
        "mirror image of one state and its goal, at the front.";
} }

/// Memory for choosing and judging rows, with unspecified contents between calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct Workspace {
    /// The draw, from 0, that each row is taken from, if rows are drawn again.
    pub(crate) attempts: Vec<u8>,
    /// The rows that are drawn in the current round.
    pub(crate) pending: Vec<usize>,
    /// Whether the goals of these rows were achieved before the step.
    pub(crate) achieved: Vec<bool>,
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
    pub(crate) columns: ColumnsMut<'a, T>,
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
        let Self { columns, len, fields, field_values, .. } = self;
        (columns, len, fields, field_values)
            == (&other.columns, &other.len, &other.fields, &other.field_values)
    }
}

impl<T> Batch<T> {
    /// Removes all rows.
    pub(crate) fn clear(&mut self) {
        self.len = 0;
        self.clear_columns();
        self.field_values.clear();
    }
}

impl<T: Scalar> Batch<T> {
    /// Creates an empty batch, which gets its size from the first sample.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns whether there are no rows, because nothing has been sampled yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Takes all columns out, to pass them on without a copy. The next draw allocates columns again
    /// unless these are [given back](Self::give_back). The fields and the length stay.
    ///
    /// # Example
    /// ```
    /// let mut batch = her_relabel::Batch::<f32>::new();
    /// // ... draw into the batch ...
    /// let mut columns = batch.take_columns();
    /// let input: Vec<f32> = std::mem::take(&mut columns.input);
    /// // ... a tensor owns the input now ...
    /// # drop(input);
    /// batch.give_back(columns);
    /// ```
    #[must_use]
    pub fn take_columns(&mut self) -> Columns<T> {
        std::mem::take(&mut self.columns)
    }

    /// Gives columns back, all or some, so that the next draw reuses their memory. This empties the
    /// batch.
    pub fn give_back(&mut self, columns: Columns<T>) {
        self.columns = columns;
        self.clear();
    }

    /// Returns whether each row got a new goal, `len` elements.
    pub fn relabeled(&self) -> impl ExactSizeIterator<Item = bool> + '_ {
        self.columns.goal_source.iter().map(Option::is_some)
    }

    /// Returns a field of the buffer's configuration, `len * field.len` elements. A window of
    /// several steps has the field of its first step.
    ///
    /// # Errors
    /// [`UnknownField`] if the sampled buffer has no such field.
    pub fn field(&self, name: &str) -> Result<&[T], UnknownField> {
        let place = self.fields.place(name)?;
        Ok(&self.field_values[place.start * self.len()..place.end * self.len()])
    }

    /// Takes over the fields of a buffer.
    pub(crate) fn follow_fields(&mut self, fields: &Fields) {
        if !self.fields.is_same(fields) {
            self.fields = fields.clone();
        }
    }

    /// Sorts the fields, which were gathered row by row, into one matrix each.
    pub(crate) fn separate_fields(&mut self) -> Result<(), SampleError> {
        let size = self.len;
        let (values, rows) = (&mut self.field_values, &mut self.scratch.field_rows);
        if self.fields.is_plain() {
            std::mem::swap(values, rows);
            return Ok(());
        }
        resize(values, rows.len(), T::default())?;
        let all = rows.len() / size.max(1);
        for (field, place) in self.fields.places() {
            let column = &mut values[place.start * size..place.end * size];
            for (to, from) in column.chunks_exact_mut(field.len).zip(rows.chunks_exact(all)) {
                to.copy_from_slice(&from[place.clone()]);
            }
        }
        Ok(())
    }
}
