//! From random words to the rows of a batch.

use std::iter;

use prefetch_index::prefetch_index;

use crate::Scalar;
use crate::sample::columns::{Relabeled, Rows};
use crate::sample::copy::copy;
use crate::sample::draws::{Draws, Purpose, unit};
use crate::sample::goals::Goal;
use crate::sample::sampler::{NStep, Sampler};
use crate::store::storage::{Storage, TransitionId};

/// How many rows each stage of [`gather`] is ahead of the next: so long does memory take.
const AHEAD: usize = 8;

/// The bytes of a cache line.
const LINE: usize = 64;

/// A row of the batch: which transition, and which goal.
#[derive(Clone, Copy)]
struct Planned<'a, T> {
    transition: u64,
    /// The tape's row of the state before the step, and its number.
    state: &'a [T],
    row: u64,
    /// The steps of the window, at least 1, and the state after them: the front of its row.
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

/// How many rows were relabeled, and how many pairs of goals they have together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) rows: usize,
    pub(crate) pairs: usize,
}

/// Draws rows and copies their transitions, which `pick` takes from random words, with rewards as
/// stored. The relabeled rows and their pairs of goals are put at the front of their scratch memory.
///
/// A row goes through four stages, `AHEAD` rows behind each other: its transition is drawn; its episode's
/// record is looked for; its goal is drawn; it is copied. Each stage asks for the memory that the next one
/// reads. The stages take turns row by row, for a processor has only a few requests under way at a
/// time, and would wait for them and do nothing if many rows were planned at once. For the same reason the
/// state after the window is asked for one row later than the rest.
pub(crate) fn gather<T: Scalar>(
    storage: &Storage<T>,
    sampler: &Sampler,
    draws: Draws,
    pick: impl Fn(u64) -> u64 + Copy,
    rows: &mut Rows<'_, T>,
) -> Counts {
    let mut counts = Counts::default();
    let mut transitions = [0; 2 * AHEAD];
    let mut planned = [Planned::NOTHING; AHEAD];
    let (episodes, len) = (&storage.episodes, rows.len());
    for at in 0..len + 3 * AHEAD {
        if let Some(row) = at.checked_sub(3 * AHEAD) {
            put(storage, sampler, &planned[row % AHEAD], row, rows, &mut counts);
        }
        if let Some(row) = at.checked_sub(2 * AHEAD + 1).filter(|row| *row < len) {
            prefetch(planned[row % AHEAD].next);
        }
        if let Some(row) = at.checked_sub(2 * AHEAD).filter(|row| *row < len) {
            let planned = &mut planned[row % AHEAD];
            let transition = transitions[row % (2 * AHEAD)];
            *planned = plan(storage, sampler, draws, transition, rows.first + row);
        }
        if let Some(row) = at.checked_sub(AHEAD).filter(|row| *row < len) {
            episodes.prefetch_record(transitions[row % (2 * AHEAD)]);
        }
        if at < len {
            let transition = pick(draws.word(rows.first + at, Purpose::Transition));
            episodes.prefetch_cell(transition);
            transitions[at % (2 * AHEAD)] = transition;
        }
    }
    counts
}

/// Draws a row's goal, and asks for all that the row will be copied from but the state after its window.
#[inline(always)]
fn plan<'a, T: Scalar>(
    storage: &'a Storage<T>,
    sampler: &Sampler,
    draws: Draws,
    transition: u64,
    row: usize,
) -> Planned<'a, T> {
    let Storage { layout, episodes, tape, .. } = storage;
    let episode = episodes.of(transition);
    let is_relabeled = unit(draws.word(row, Purpose::Relabel)) < sampler.ratio.get();
    let strategy = sampler.goals.choose(|| draws.word(row, Purpose::Strategy));
    let goals = [
        Goal { source: transition, row: episode.last_row(), is_desired: true },
        strategy.draw(transition, &episode, episodes, draws.word(row, Purpose::Goal)),
    ];
    // No branch, for which rows are relabeled cannot be predicted.
    let goal = goals[usize::from(is_relabeled)];
    let goal_source = goal.source;
    let left = episode.end - transition;
    let steps = left.min(sampler.window() as u64);
    let is_last = steps == left;
    let row = episode.row(transition);
    let state = tape.rows_from(row);
    let next_at = layout.row() * steps as usize;
    let next = match state.get(next_at..next_at + layout.state().end) {
        Some(next) => {
            prefetch(&state[..next_at]);
            next
        }
        None => prefetch_apart(storage, row, steps),
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

/// Asks for every cache line of a slice.
#[inline(always)]
fn prefetch<T>(slice: &[T]) {
    let mut at = 0;
    while at < slice.len() {
        prefetch_index(slice, at);
        at += LINE / size_of::<T>();
    }
    prefetch_index(slice, slice.len() - 1);
}

/// Asks for a window that does not lie in one piece, and returns the state after it.
#[cold]
fn prefetch_apart<T: Scalar>(storage: &Storage<T>, row: u64, steps: u64) -> &[T] {
    (row..row + steps).for_each(|row| prefetch(storage.tape.row(row)));
    &storage.tape.row(row + steps)[storage.layout.state()]
}

/// The states of a window between its first and its last.
fn between<'a, T: Scalar>(
    storage: &'a Storage<T>,
    planned: &Planned<'_, T>,
) -> impl Iterator<Item = &'a [T]> {
    let row = planned.row;
    (1..planned.steps).map(move |step| storage.tape.row(row + step))
}

/// Copies a transition to the row at `at`.
#[inline(always)]
fn put<T: Scalar>(
    storage: &Storage<T>,
    sampler: &Sampler,
    planned: &Planned<'_, T>,
    at: usize,
    rows: &mut Rows<'_, T>,
    counts: &mut Counts,
) {
    let layout = &storage.layout;
    let Planned { transition, state, next, goal, goal_source, .. } = *planned;
    put_part(rows.observation, at, &state[layout.observation()]);
    put_part(rows.achieved_goal, at, &state[layout.achieved_goal()]);
    put_part(rows.desired_goal, at, goal);
    put_part(rows.action, at, &state[layout.action()]);
    rows.reward[at] = state[layout.reward()];
    put_part(rows.next_observation, at, &next[layout.observation()]);
    put_part(rows.next_achieved_goal, at, &next[layout.achieved_goal()]);
    if !rows.fields.is_empty() {
        put_part(rows.fields, at, &state[layout.fields()]);
    }
    rows.terminated[at] = planned.terminated;
    rows.truncated[at] = planned.truncated;
    rows.transition[at] = TransitionId::of(transition);
    rows.goal_source[at] = goal_source;
    if let Some(n_step) = sampler.n_step {
        put_return(storage, n_step, planned, at, rows);
    }
    put_pairs(storage, planned, at, rows, counts);
}

/// Copies a part of a transition to the row at `at` of its column.
#[inline(always)]
fn put_part<T: Copy>(column: &mut [T], at: usize, part: &[T]) {
    let width = part.len();
    copy(&mut column[at * width..][..width], part);
}

/// Puts the discounted sum of the stored rewards in the place of the first reward.
fn put_return<T: Scalar>(
    storage: &Storage<T>,
    n_step: NStep,
    planned: &Planned<'_, T>,
    at: usize,
    rows: &mut Rows<'_, T>,
) {
    let states = iter::once(planned.state).chain(between(storage, planned));
    let rewards = states.map(|state| state[storage.layout.reward()].to_f64());
    let (sum, discount) = n_step.gamma.sum(rewards);
    rows.reward[at] = T::from_f64(sum);
    rows.discount[at] = T::from_f64(discount);
}

/// Puts the pairs of goals of a row side by side: of each step of the window what it achieved, and the
/// new goal. They are kept if the row is relabeled.
#[inline(always)]
fn put_pairs<T: Scalar>(
    storage: &Storage<T>,
    planned: &Planned<'_, T>,
    at: usize,
    rows: &mut Rows<'_, T>,
    counts: &mut Counts,
) {
    let achieved_goal = storage.layout.achieved_goal();
    let steps = planned.steps as usize;
    let last = counts.pairs + steps - 1;
    put_wide(rows.achieved_pairs, last, &planned.next[achieved_goal.clone()]);
    put_wide(rows.desired_pairs, last, planned.goal);
    if steps > 1 {
        for (pair, state) in (counts.pairs..).zip(between(storage, planned)) {
            put_wide(rows.achieved_pairs, pair, &state[achieved_goal.clone()]);
            put_wide(rows.desired_pairs, pair, planned.goal);
        }
    }
    rows.relabeled[counts.rows] = Relabeled { row: rows.first + at, pairs: steps, used: steps };
    // No branch, for which rows are relabeled cannot be predicted.
    let is_relabeled = usize::from(planned.goal_source.is_some());
    counts.rows += is_relabeled;
    counts.pairs += is_relabeled * steps;
}

/// Puts a goal in its place among the numbers that reward functions take.
#[inline(always)]
fn put_wide<T: Scalar>(goals: &mut [f64], at: usize, goal: &[T]) {
    let target = &mut goals[at * goal.len()..][..goal.len()];
    // Most goals are places.
    if let ([x, y, z], &[from_x, from_y, from_z]) = (&mut *target, goal) {
        (*x, *y, *z) = (from_x.to_f64(), from_y.to_f64(), from_z.to_f64());
    } else {
        widen(target, goal);
    }
}

#[inline(never)]
fn widen<T: Scalar>(target: &mut [f64], source: &[T]) {
    for (target, source) in target.iter_mut().zip(source) {
        *target = source.to_f64();
    }
}
