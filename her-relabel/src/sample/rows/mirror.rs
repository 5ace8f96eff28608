//! Mirrored rows.

use goal_reward::{Mirror, Symmetry};

use crate::sample::random::{BatchWords, Stream, Words};
use crate::sample::rows::batch::Rows;
use crate::sample::rows::copy::put_wide;
use crate::sample::rows::form::{Form, Formed, State};
use crate::scalar::Scalar;
use crate::split_mix::unit;
use crate::unit_interval::UnitInterval;

/// The form of a batch in which some rows are mirrored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mirroring<'a> {
    form: Formed<'a>,
    symmetry: &'a Symmetry,
    share: UnitInterval,
    words: BatchWords,
}

impl<'a> Mirroring<'a> {
    /// Mirrors the average share `share` of the rows, chosen by `words`, and writes all rows in
    /// `form`.
    pub(crate) fn new(
        form: Formed<'a>,
        symmetry: &'a Symmetry,
        share: UnitInterval,
        words: BatchWords,
    ) -> Self {
        Self { form, symmetry, share, words: words.mirroring() }
    }

    /// Returns whether the row at `at` is mirrored.
    #[inline(always)]
    fn mirrors<T>(&self, rows: &Rows<'_, T>, at: usize) -> bool {
        unit(self.words.word(rows.first + at, Stream::Transition)) < self.share.get()
    }

    /// Writes the mirror images of a state and its goal to `memory`, and returns both.
    fn mirror<'m, S: Scalar, G: Scalar>(
        &self,
        memory: &'m mut [f64],
        state: State<'m, S>,
        goal: &[G],
    ) -> (State<'m, f64>, &'m [f64]) {
        let layout = state.layout;
        let (row, mirrored_goal) = memory.split_at_mut(layout.state().end);
        put(&self.symmetry.observation, &mut row[layout.observation()], state.observation());
        put(&self.symmetry.goal, &mut row[layout.achieved_goal()], state.achieved_goal());
        put(&self.symmetry.goal, mirrored_goal, goal);
        (State { layout, row }, &mirrored_goal[..goal.len()])
    }

    /// Writes the state before the step, and the goal.
    fn write_state<S: Scalar, G: Scalar, T: Scalar>(
        self,
        rows: &mut Rows<'_, T>,
        at: usize,
        state: State<'_, S>,
        goal: &[G],
    ) {
        if !self.mirrors(rows, at) {
            return self.form.write_state(rows, at, state, goal);
        }
        // Taken out, because the rows change while it is read.
        let memory = std::mem::take(&mut rows.scratch.mirrored);
        let (mirrored, mirrored_goal) = self.mirror(memory, state, goal);
        self.form.write_state(rows, at, mirrored, mirrored_goal);
        rows.scratch.mirrored = memory;
        // A mirror image may differ in the last bit of a distance.
        if !rows.scratch.judged_desired.is_empty() {
            put_wide(rows.scratch.judged_desired, at, goal);
        }
    }
}

/// Writes the mirror image of a vector to the start of `target`.
#[inline(always)]
fn put<S: Scalar, T: Scalar>(mirror: &Mirror, target: &mut [T], vector: &[S]) {
    for (target, element) in target.iter_mut().zip(mirror.elements()) {
        *target = T::from_f64(element.of(|index| vector[index].to_f64()));
    }
}

impl<S: Scalar, T: Scalar> Form<S, T> for Mirroring<'_> {
    fn put(self, column: &mut [T], at: usize, part: &[S]) {
        self.form.put(column, at, part);
    }

    fn put_action(self, rows: &mut Rows<'_, T>, at: usize, action: &[S]) {
        if self.mirrors(rows, at) {
            put(&self.symmetry.action, &mut rows.columns.action[at * action.len()..], action);
        } else {
            self.form.put_action(rows, at, action);
        }
    }

    fn put_state(self, rows: &mut Rows<'_, T>, at: usize, state: State<'_, S>, goal: &[S]) {
        self.write_state(rows, at, state, goal);
    }

    fn put_next<G: Scalar>(
        self,
        rows: &mut Rows<'_, T>,
        at: usize,
        next: State<'_, S>,
        goal: &[G],
    ) {
        if !self.mirrors(rows, at) {
            return self.form.put_next(rows, at, next, goal);
        }
        let memory = std::mem::take(&mut rows.scratch.mirrored);
        let (mirrored, mirrored_goal) = self.mirror(memory, next, goal);
        self.form.put_next(rows, at, mirrored, mirrored_goal);
        rows.scratch.mirrored = memory;
        if !rows.scratch.judged_achieved.is_empty() {
            put_wide(rows.scratch.judged_achieved, at, next.achieved_goal());
        }
    }

    fn put_moved<G: Scalar>(
        self,
        rows: &mut Rows<'_, T>,
        at: usize,
        [state, next]: [State<'_, S>; 2],
        goal: &[G],
    ) {
        self.write_state(rows, at, state, goal);
        self.put_next(rows, at, next, goal);
    }
}
