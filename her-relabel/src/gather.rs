//! From random words to the rows of a batch.

use std::ops::Range;

use prefetch_index::prefetch_index;

use crate::Scalar;
use crate::copy::copy_part;
use crate::draws::{Draws, Purpose, unit};
use crate::rows::{Relabelled, Rows};
use crate::sampler::{NStep, Sampler};
use crate::storage::{Storage, TransitionId};
use crate::strategy::Goal;

/// How many rows are worked on at a time: enough to wait for many cache lines at once, and few enough for
/// them to stay in the first-level cache.
const CHUNK: usize = 32;

/// The bytes of a cache line.
const LINE: usize = 64;

/// A row of the batch: which transition, and which goal.
#[derive(Clone, Copy)]
struct Planned<'a, T> {
    transition: u64,
    /// The tape's row of the state before the step, and its number.
    state: &'a [T],
    row: u64,
    /// The steps of the window, at least 1, and the tape's row of the state after them.
    steps: u64,
    next: &'a [T],
    goal: &'a [T],
    goal_source: Option<TransitionId>,
    terminated: bool,
    truncated: bool,
}

impl<T> Planned<'_, T> {
    const NOTHING: Self = Self {
        transition: 0,
        state: &[],
        row: 0,
        steps: 0,
        next: &[],
        goal: &[],
        goal_source: None,
        terminated: false,
        truncated: false,
    };
}

/// How many rows were relabelled, and how many pairs of goals they have together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) rows: usize,
    pub(crate) pairs: usize,
}

/// Draws rows and copies their transitions, which `pick` takes from random words, with rewards as stored. The relabelled rows and their pairs
/// of goals are put at the front of their scratch memory.
pub(crate) fn gather<T: Scalar>(
    storage: &Storage<T>,
    sampler: &Sampler,
    draws: Draws,
    pick: impl Fn(u64) -> u64 + Copy,
    rows: &mut Rows<'_, T>,
) -> Counts {
    let mut counts = Counts::default();
    let mut chunk = [Planned::NOTHING; CHUNK];
    for start in (0..rows.len()).step_by(CHUNK) {
        let chunk = &mut chunk[..CHUNK.min(rows.len() - start)];
        for (row, planned) in (rows.first + start..).zip(&mut *chunk) {
            *planned = plan(storage, sampler, draws, pick, row);
            prefetch(storage, planned);
        }
        put(storage, chunk, start, rows);
        if let Some(n_step) = sampler.n_step {
            put_returns(storage, n_step, chunk, start, rows);
        }
        put_pairs(storage, chunk, start, rows, &mut counts);
    }
    counts
}

#[inline(always)]
fn plan<'a, T: Scalar>(
    storage: &'a Storage<T>,
    sampler: &Sampler,
    draws: Draws,
    pick: impl Fn(u64) -> u64,
    row: usize,
) -> Planned<'a, T> {
    let Storage { layout, episodes, tape, .. } = storage;
    let transition = pick(draws.word(row, Purpose::Transition));
    let episode = episodes.of(transition);
    let is_relabelled = unit(draws.word(row, Purpose::Relabel)) < sampler.ratio.get();
    let goal = if is_relabelled {
        let strategy = sampler.goals.choose(|| draws.word(row, Purpose::Strategy));
        strategy.draw(transition, &episode, episodes, draws.word(row, Purpose::Goal))
    } else {
        Goal { source: transition, row: episode.last_row(), is_desired: true }
    };
    let left = episode.live.end - transition;
    let steps = left.min(sampler.window() as u64);
    let is_last = steps == left;
    let row = episode.row(transition);
    Planned {
        transition,
        state: tape.row(row),
        row,
        steps,
        next: tape.row(row + steps),
        goal: &tape.row(goal.row)[layout.goal(goal.is_desired)],
        goal_source: is_relabelled.then_some(TransitionId::of(goal.source)),
        terminated: is_last & episode.ending.terminated,
        truncated: is_last & episode.ending.truncated,
    }
}

/// Asks for every cache line that the row will be copied from. The memory is far slower than the
/// processor, which plans the other rows of the chunk meanwhile.
#[inline(always)]
fn prefetch<T: Scalar>(storage: &Storage<T>, planned: &Planned<'_, T>) {
    let prefetch_row = |row: &[T]| {
        for at in (0..row.len()).step_by(LINE / size_of::<T>()) {
            prefetch_index(row, at);
        }
    };
    prefetch_row(planned.state);
    for step in 1..planned.steps {
        prefetch_row(storage.tape.row(planned.row + step));
    }
    prefetch_row(planned.next);
    prefetch_index(planned.goal, 0);
    prefetch_index(planned.goal, planned.goal.len() - 1);
}

/// Copies transitions to the rows from `start` on, column by column.
#[inline(always)]
fn put<T: Scalar>(
    storage: &Storage<T>,
    chunk: &[Planned<'_, T>],
    start: usize,
    rows: &mut Rows<'_, T>,
) {
    let layout = &storage.layout;
    let states = || chunk.iter().map(|planned| planned.state);
    let nexts = || chunk.iter().map(|planned| planned.next);
    let goals = chunk.iter().map(|planned| planned.goal);
    column(rows.observation, start, states(), layout.observation());
    column(rows.achieved_goal, start, states(), layout.achieved_goal());
    column(rows.desired_goal, start, goals, 0..layout.dims().goal);
    column(rows.action, start, states(), layout.action());
    column(rows.reward, start, states(), layout.reward()..layout.reward() + 1);
    column(rows.next_observation, start, nexts(), layout.observation());
    column(rows.next_achieved_goal, start, nexts(), layout.achieved_goal());
    column(rows.fields, start, states(), layout.fields());
    let terminated = &mut rows.terminated[start..][..chunk.len()];
    let truncated = &mut rows.truncated[start..][..chunk.len()];
    let transition = &mut rows.transition[start..][..chunk.len()];
    let goal_source = &mut rows.goal_source[start..][..chunk.len()];
    for (at, planned) in chunk.iter().enumerate() {
        terminated[at] = planned.terminated;
        truncated[at] = planned.truncated;
        transition[at] = TransitionId::of(planned.transition);
        goal_source[at] = planned.goal_source;
    }
}

/// Copies the same `part` of some rows to the rows of a column from `start` on.
#[inline(always)]
fn column<'a, T: Scalar>(
    column: &mut [T],
    start: usize,
    rows: impl Iterator<Item = &'a [T]>,
    part: Range<usize>,
) {
    let width = part.len();
    copy_part(&mut column[start * width..], rows, (part.start, width));
}

/// Puts the discounted sums of the stored rewards in the place of the first rewards.
fn put_returns<T: Scalar>(
    storage: &Storage<T>,
    n_step: NStep,
    chunk: &[Planned<'_, T>],
    start: usize,
    rows: &mut Rows<'_, T>,
) {
    let Storage { layout, tape, .. } = storage;
    for (at, planned) in (start..).zip(chunk) {
        let rewards = (0..planned.steps).map(|step| tape.row(planned.row + step)[layout.reward()]);
        let (sum, discount) = n_step.gamma.sum(rewards.map(T::to_f64));
        rows.reward[at] = T::from_f64(sum);
        rows.discount[at] = T::from_f64(discount);
    }
}

/// Puts the pairs of goals of the relabelled rows side by side: of each step of the window what it
/// achieved, and the new goal.
#[inline(always)]
fn put_pairs<T: Scalar>(
    storage: &Storage<T>,
    chunk: &[Planned<'_, T>],
    start: usize,
    rows: &mut Rows<'_, T>,
    counts: &mut Counts,
) {
    let mut relabelled = [0; CHUNK];
    let (mut count, mut pairs) = (0, 0);
    for (at, planned) in chunk.iter().enumerate() {
        // Written for every row, and kept for the relabelled ones: no branch to be mispredicted.
        let (row, steps) = (rows.first + start + at, planned.steps as usize);
        relabelled[count] = at;
        rows.relabelled[counts.rows + count] = Relabelled { row, pairs: steps, used: steps };
        let is_relabelled = planned.goal_source.is_some();
        count += usize::from(is_relabelled);
        pairs += if is_relabelled { steps } else { 0 };
    }
    let Storage { layout, tape, .. } = storage;
    let dim = layout.dims().goal;
    let achieved_pairs = &mut rows.achieved_pairs[counts.pairs * dim..];
    let desired_pairs = &mut rows.desired_pairs[counts.pairs * dim..];
    let (achieved, desired) = ((layout.achieved_goal().start, dim), (0, dim));
    let relabelled = relabelled[..count].iter().map(|at| &chunk[*at]);
    if pairs == count {
        copy_part(achieved_pairs, relabelled.clone().map(|row| row.next), achieved);
        copy_part(desired_pairs, relabelled.map(|row| row.goal), desired);
    } else {
        let steps = relabelled.flat_map(|row| (1..=row.steps).map(move |step| (row, step)));
        let states = steps.clone().map(|(row, step)| tape.row(row.row + step));
        copy_part(achieved_pairs, states, achieved);
        copy_part(desired_pairs, steps.map(|(row, _)| row.goal), desired);
    }
    counts.rows += count;
    counts.pairs += pairs;
}
