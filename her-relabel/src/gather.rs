//! From random words to the rows of a batch.

use std::hint::black_box;

use crate::Scalar;
use crate::copy::copy;
use crate::draws::{Draws, Purpose, unit};
use crate::episodes::Ending;
use crate::rows::{Relabelled, Rows};
use crate::sampler::Sampler;
use crate::storage::{Storage, TransitionId};
use crate::strategy::Goal;

/// How many rows are worked on at a time: enough to wait for many cache lines at once, and few enough for
/// them to stay in the first-level cache.
const CHUNK: usize = 32;

/// The bytes of a cache line.
const LINE: usize = 64;

/// A row of the batch: which transition, and which goal.
#[derive(Clone, Copy)]
struct Planned {
    transition: u64,
    /// The tape's row of the state before the step.
    row: u64,
    /// The steps of the window, at least 1.
    steps: u64,
    /// Whether the window ends where the episode does.
    is_last: bool,
    ending: Ending,
    goal: Goal,
    relabelled: bool,
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
    for start in (0..rows.len()).step_by(CHUNK) {
        let len = CHUNK.min(rows.len() - start);
        let first = rows.first + start;
        let mut chunk: [Planned; CHUNK] =
            std::array::from_fn(|at| plan(storage, sampler, draws, pick, first + at.min(len - 1)));
        let chunk = &mut chunk[..len];
        // The processor waits for one cache line after another while it copies, because a row's copies
        // fill its window of instructions. Loads alone are waited for together.
        black_box(chunk.iter().fold(0, |sum, planned| sum | touch(storage, planned)));
        for (at, planned) in chunk.iter().enumerate() {
            put(storage, sampler, planned, start + at, rows, &mut counts);
        }
        put_fields(storage, chunk, start, rows);
    }
    counts
}

#[inline(always)]
fn plan<T: Scalar>(
    storage: &Storage<T>,
    sampler: &Sampler,
    draws: Draws,
    pick: impl Fn(u64) -> u64,
    row: usize,
) -> Planned {
    let episodes = &storage.episodes;
    let transition = pick(draws.word(row, Purpose::Transition));
    let episode = episodes.of(transition);
    let relabelled = unit(draws.word(row, Purpose::Relabel)) < sampler.ratio.get();
    let goal = if relabelled {
        let strategy = sampler.goals.choose(|| draws.word(row, Purpose::Strategy));
        strategy.draw(transition, &episode, episodes, draws.word(row, Purpose::Goal))
    } else {
        Goal { source: transition, row: episode.last_row(), is_desired: true }
    };
    let left = episode.live.end - transition;
    let steps = left.min(sampler.window() as u64);
    Planned {
        transition,
        row: episode.row(transition),
        steps,
        is_last: steps == left,
        ending: episode.ending,
        goal,
        relabelled,
    }
}

/// Reads an element of every cache line that the row will be copied from.
#[inline(always)]
fn touch<T: Scalar>(storage: &Storage<T>, planned: &Planned) -> u64 {
    let Storage { layout, tape, .. } = storage;
    let mut sum = 0;
    for step in 0..=planned.steps {
        for line in tape.row(planned.row + step).chunks(LINE / size_of::<T>()) {
            sum |= line[0].bits();
        }
    }
    let goal = &tape.row(planned.goal.row)[layout.goal(planned.goal.is_desired)];
    sum | goal[0].bits() | goal[goal.len() - 1].bits()
}

/// Copies a transition to row `at` of `rows`.
#[inline(always)]
fn put<T: Scalar>(
    storage: &Storage<T>,
    sampler: &Sampler,
    planned: &Planned,
    at: usize,
    rows: &mut Rows<'_, T>,
    counts: &mut Counts,
) {
    let Storage { layout, tape, .. } = storage;
    let dims = layout.dims();
    let state = tape.row(planned.row);
    let next = tape.row(planned.row + planned.steps);
    let goal = &tape.row(planned.goal.row)[layout.goal(planned.goal.is_desired)];
    copy(&mut rows.observation[at * dims.observation..], &state[layout.observation()]);
    copy(&mut rows.achieved_goal[at * dims.goal..], &state[layout.achieved_goal()]);
    copy(&mut rows.desired_goal[at * dims.goal..], goal);
    copy(&mut rows.action[at * dims.action..], &state[layout.action()]);
    copy(&mut rows.next_observation[at * dims.observation..], &next[layout.observation()]);
    copy(&mut rows.next_achieved_goal[at * dims.goal..], &next[layout.achieved_goal()]);
    rows.reward[at] = state[layout.reward()];
    rows.terminated[at] = planned.is_last & planned.ending.terminated;
    rows.truncated[at] = planned.is_last & planned.ending.truncated;
    rows.transition[at] = TransitionId::of(planned.transition);
    rows.goal_source[at] = planned.relabelled.then_some(TransitionId::of(planned.goal.source));
    if let Some(n_step) = sampler.n_step {
        let rewards = (0..planned.steps).map(|step| tape.row(planned.row + step)[layout.reward()]);
        let (sum, discount) = n_step.gamma.sum(rewards.map(T::to_f64));
        rows.reward[at] = T::from_f64(sum);
        rows.discount[at] = T::from_f64(discount);
    }
    // Written for every row, and kept for the relabelled ones: no branch to be mispredicted.
    let steps = planned.steps as usize;
    rows.relabelled[counts.rows] = Relabelled { row: rows.first + at, pairs: steps, used: steps };
    let mut pair = counts.pairs;
    for step in 1..=planned.steps {
        let achieved = &tape.row(planned.row + step)[layout.achieved_goal()];
        widen(&mut rows.achieved_pairs[pair * dims.goal..][..dims.goal], achieved);
        widen(&mut rows.desired_pairs[pair * dims.goal..][..dims.goal], goal);
        pair += 1;
    }
    counts.rows += usize::from(planned.relabelled);
    counts.pairs = if planned.relabelled { pair } else { counts.pairs };
}

/// Copies the fields of some rows to those from `start` on.
#[inline(always)]
fn put_fields<T: Scalar>(
    storage: &Storage<T>,
    chunk: &[Planned],
    start: usize,
    rows: &mut Rows<'_, T>,
) {
    let fields = storage.layout.fields();
    if fields.is_empty() {
        return;
    }
    let targets = rows.fields[start * fields.len()..].chunks_exact_mut(fields.len());
    for (target, planned) in targets.zip(chunk) {
        copy(target, &storage.tape.row(planned.row)[fields.clone()]);
    }
}

#[inline(always)]
fn widen<T: Scalar>(target: &mut [f64], source: &[T]) {
    for (target, source) in target.iter_mut().zip(source) {
        *target = source.to_f64();
    }
}
