//! Turning random words into the rows of a batch, on one thread or several.

use std::sync::atomic::{AtomicU32, Ordering::SeqCst};
use std::{iter, process};

use prefetch_index::prefetch_index;

use crate::sample::draw::chosen_goal::{ChosenGoal, Draw};
use crate::sample::random::{Stream, Words};
use crate::sample::rows::batch::{Relabeled, Rows};
use crate::sample::rows::copy::put_wide;
use crate::sample::rows::form::{Form, State};
use crate::sample::settings::n_step::NStep;
use crate::scalar::Scalar;
use crate::store::storage::Storage;
use crate::store::transition_id::TransitionId;

/// The number of rows by which each stage of [`gather_part`](Draw::gather_part) is ahead of the
/// next: the latency of memory.
const AHEAD: usize = 8;

/// The largest number of rows that does not gain from another thread.
const PART: usize = 512;

/// The number of bytes of a cache line.
const LINE: usize = 64;

/// A drawn row of the batch: its transition and its goal.
#[derive(Clone, Copy, Default)]
struct Planned<'a, T> {
    transition: u64,
    /// The tape's row of the state before the step, and its number.
    state: &'a [T],
    row: u64,
    /// The number of steps of the window, at least 1, and the state after them, which begins its
    /// row.
    steps: u64,
    next: &'a [T],
    goal: &'a [T],
    goal_source: Option<TransitionId>,
    terminated: bool,
    truncated: bool,
}

/// The number of relabeled rows, and of all their pairs of goals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) rows: usize,
    pub(crate) pairs: usize,
}

impl<'a, S: Scalar> Draw<'a, S> {
    /// Draws rows and copies their transitions, which `pick` chooses by random words, with the
    /// stored rewards. The relabeled rows and their pairs of goals go to the front of their scratch
    /// memory.
    ///
    /// Large batches are drawn in parts, on the threads of the current rayon pool, if the sampler
    /// asks for it. Every row is a function of the random words of its place in the batch, so the
    /// division into parts does not change the batch.
    pub(crate) fn gather<T: Scalar>(
        self,
        pick: impl Fn(u64) -> u64 + Copy + Sync,
        words: impl Words,
        form: impl Form<S, T>,
        rows: &mut Rows<'_, T>,
    ) -> Counts {
        let part = if self.sampler.parallel() && have_threads() { PART } else { usize::MAX };
        self.gather_parts(pick, words, form, rows, part)
    }

    fn gather_parts<T: Scalar>(
        self,
        pick: impl Fn(u64) -> u64 + Copy + Sync,
        words: impl Words,
        form: impl Form<S, T>,
        rows: &mut Rows<'_, T>,
        part: usize,
    ) -> Counts {
        if rows.len() <= part {
            return self.gather_part(pick, words, form, rows);
        }
        let middle = rows.len() / 2;
        let (mut front, mut back) = rows.split_at(middle);
        let (first, second) = rayon::join(
            || self.gather_parts(pick, words, form, &mut front, part),
            || self.gather_parts(pick, words, form, &mut back, part),
        );
        // The back's relabeled rows follow the front's, as in a batch of one part.
        let (scratch, goal, goals) = (&mut rows.scratch, rows.widths.goal, rows.widths.goals);
        scratch.relabeled.copy_within(middle..middle + second.rows, first.rows);
        let pairs = middle * goals..middle * goals + second.pairs * goal;
        scratch.achieved_pairs.copy_within(pairs.clone(), first.pairs * goal);
        scratch.desired_pairs.copy_within(pairs, first.pairs * goal);
        Counts { rows: first.rows + second.rows, pairs: first.pairs + second.pairs }
    }

    /// Draws rows on this thread.
    ///
    /// A row passes four stages, each `AHEAD` rows behind the one before: its transition is drawn;
    /// its episode's record is looked up; its goal is drawn; it is copied. Each stage prefetches
    /// the memory that the next one reads. The stages take turns row by row, because a processor
    /// has only a few memory requests in flight, and would idle if many rows were planned at once.
    /// For the same reason, the state after the window is prefetched one row later than the rest.
    // Not inlined, so that the code around the loop takes none of its registers.
    #[inline(never)]
    fn gather_part<T: Scalar>(
        self,
        pick: impl Fn(u64) -> u64 + Copy,
        words: impl Words,
        form: impl Form<S, T>,
        rows: &mut Rows<'_, T>,
    ) -> Counts {
        let mut counts = Counts::default();
        let mut transitions = [0; 2 * AHEAD];
        let mut planned = [Planned::default(); AHEAD];
        let (episodes, len) = (&self.storage.episodes, rows.len());
        for at in 0..len + 3 * AHEAD {
            if let Some(row) = at.checked_sub(3 * AHEAD) {
                self.put(form, &planned[row % AHEAD], row, rows, &mut counts);
            }
            if let Some(row) = at.checked_sub(2 * AHEAD + 1).filter(|row| *row < len) {
                prefetch(planned[row % AHEAD].next);
            }
            if let Some(row) = at.checked_sub(2 * AHEAD).filter(|row| *row < len) {
                let planned = &mut planned[row % AHEAD];
                let transition = transitions[row % (2 * AHEAD)];
                *planned = self.plan(words, transition, rows.first + row);
            }
            if let Some(row) = at.checked_sub(AHEAD).filter(|row| *row < len) {
                episodes.prefetch_record(transitions[row % (2 * AHEAD)]);
            }
            if at < len {
                let transition = pick(words.word(rows.first + at, Stream::Transition));
                episodes.prefetch_cell(transition);
                transitions[at % (2 * AHEAD)] = transition;
            }
        }
        counts
    }

    /// Draws a row's goal, and prefetches all that the row is copied from except the state after
    /// its window.
    #[inline(always)]
    fn plan(self, words: impl Words, transition: u64, row: usize) -> Planned<'a, S> {
        let Storage { layout, tape, .. } = self.storage;
        let ChosenGoal { episode, goal, is_relabeled } = self.choose_goal(words, transition, row);
        let goal_source = goal.source;
        let left = episode.end - transition;
        let steps = left.min(self.sampler.window() as u64);
        let is_last = steps == left;
        let row = episode.row(transition);
        let state = tape.rows_from(row);
        let next_at = layout.row() * steps as usize;
        let next = match state.get(next_at..next_at + layout.state().end) {
            Some(next) => {
                prefetch(&state[..next_at]);
                next
            }
            None => prefetch_apart(self.storage, row, steps),
        };
        let goal = &tape.rows_from(goal.row)[layout.goal(goal.is_desired)];
        prefetch(goal);
        Planned {
            transition,
            state,
            row,
            steps,
            next,
            goal,
            goal_source: TransitionId::of_if(goal_source, is_relabeled),
            terminated: is_last & episode.ending.terminated,
            truncated: is_last & episode.ending.truncated,
        }
    }

    /// Returns the states of a window between the first and the last.
    fn between(self, planned: &Planned<'_, S>) -> impl Iterator<Item = &'a [S]> + use<'a, S> {
        let row = planned.row;
        (1..planned.steps).map(move |step| self.storage.tape.row(row + step))
    }

    /// Copies a transition to the row at `at`.
    #[inline(always)]
    fn put<T: Scalar>(
        self,
        form: impl Form<S, T>,
        planned: &Planned<'_, S>,
        at: usize,
        rows: &mut Rows<'_, T>,
        counts: &mut Counts,
    ) {
        let layout = &self.storage.layout;
        let Planned { transition, state, next, goal, goal_source, .. } = *planned;
        form.put_state(rows, at, State { layout, row: state }, goal);
        form.put_action(rows, at, &state[layout.action()]);
        rows.columns.reward[at] = T::from_f64(state[layout.reward()].to_f64());
        form.put_next(rows, at, State { layout, row: next }, goal);
        if !rows.scratch.field_rows.is_empty() {
            form.put(rows.scratch.field_rows, at, &state[layout.fields()]);
        }
        rows.columns.terminated[at] = planned.terminated;
        rows.columns.truncated[at] = planned.truncated;
        rows.columns.transition[at] = TransitionId::of(transition);
        rows.columns.goal_source[at] = goal_source;
        if let Some(n_step) = self.sampler.n_step() {
            self.put_return(n_step, planned, at, rows);
        }
        self.put_pairs(planned, at, rows, counts);
    }

    /// Replaces the row's reward with the discounted sum of the stored rewards of its window.
    fn put_return<T: Scalar>(
        self,
        n_step: NStep,
        planned: &Planned<'_, S>,
        at: usize,
        rows: &mut Rows<'_, T>,
    ) {
        let states = iter::once(planned.state).chain(self.between(planned));
        let rewards = states.map(|state| state[self.storage.layout.reward()].to_f64());
        let (sum, discount) = n_step.sum(rewards);
        rows.columns.reward[at] = T::from_f64(sum);
        rows.columns.discount[at] = T::from_f64(if planned.terminated { 0.0 } else { discount });
    }

    /// Appends the pairs of goals of a row: the goal achieved by each step of the window, and the
    /// row's goal. They are kept only if its reward is recomputed.
    #[inline(always)]
    fn put_pairs<T: Scalar>(
        self,
        planned: &Planned<'_, S>,
        at: usize,
        rows: &mut Rows<'_, T>,
        counts: &mut Counts,
    ) {
        let achieved_goal = self.storage.layout.achieved_goal();
        let steps = planned.steps as usize;
        let last = counts.pairs + steps - 1;
        put_wide(rows.scratch.achieved_pairs, last, &planned.next[achieved_goal.clone()]);
        put_wide(rows.scratch.desired_pairs, last, planned.goal);
        if steps > 1 {
            for (pair, state) in (counts.pairs..).zip(self.between(planned)) {
                put_wide(rows.scratch.achieved_pairs, pair, &state[achieved_goal.clone()]);
                put_wide(rows.scratch.desired_pairs, pair, planned.goal);
            }
        }
        rows.scratch.relabeled[counts.rows] =
            Relabeled { row: rows.first + at, pairs: steps, used: steps };
        // No branch, because it would be unpredictable which rows are relabeled.
        let is_relabeled = planned.goal_source.is_some();
        let is_kept = usize::from(is_relabeled | self.sampler.recomputed_rewards());
        counts.rows += is_kept;
        counts.pairs += is_kept * steps;
    }
}

/// Prefetches every cache line of a slice.
#[inline(always)]
fn prefetch<T>(slice: &[T]) {
    let mut at = 0;
    while at < slice.len() {
        prefetch_index(slice, at);
        at += LINE / size_of::<T>();
    }
    prefetch_index(slice, slice.len() - 1);
}

/// Prefetches a window that is not contiguous, and returns the state after it.
#[cold]
fn prefetch_apart<T: Scalar>(storage: &Storage<T>, row: u64, steps: u64) -> &[T] {
    (row..row + steps).for_each(|row| prefetch(storage.tape.row(row)));
    &storage.tape.row(row + steps)[storage.layout.state()]
}

/// Returns whether threads help to draw. They do not in a process that was forked from one that has
/// drawn with them, because the child has none of the pool's threads and would wait forever. In a
/// pool that the child created, they do.
fn have_threads() -> bool {
    /// The first process that has drawn with threads.
    static PROCESS: AtomicU32 = AtomicU32::new(NONE);
    const NONE: u32 = 0;
    let own = process::id();
    let first = PROCESS.compare_exchange(NONE, own, SeqCst, SeqCst).unwrap_or_else(|first| first);
    [NONE, own].contains(&first) || rayon::current_thread_index().is_some()
}
