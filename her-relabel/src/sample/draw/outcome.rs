//! The outcomes of drawn rows: rewards, termination, success and importance weights.

use goal_reward::{GoalPairs, GoalReward};

use crate::sample::draw::chosen_goal::Draw;
use crate::sample::draw::gather::Counts;
use crate::sample::error::SampleError;
use crate::sample::rows::batch::{Relabeled, Rows, Workspace};
use crate::sample::rows::columns::refill;
use crate::sample::rows::copy::widen;
use crate::sample::rows::form::{Form, State};
use crate::sample::settings::sampler::Sampler;
use crate::sample::settings::termination::Termination;
use crate::scalar::Scalar;
use crate::store::episodes::Episodes;
use crate::store::priorities::PriorityUnit;
use crate::store::priority_table::PriorityTable;
use crate::store::storage::Storage;
use crate::unit_interval::UnitInterval;

/// Computes everything in the gathered rows that depends on their goals.
pub(crate) fn compute<S: Scalar, T: Scalar>(
    Draw { storage, sampler }: Draw<'_, S>,
    reward: &dyn GoalReward,
    form: impl Form<S, T>,
    counts: Counts,
    rows: &mut Rows<'_, T>,
    workspace: &mut Workspace,
) -> Result<(), SampleError> {
    if counts.rows > 0 {
        let goal_dim = storage.layout.dims().goal;
        let elements = counts.pairs * goal_dim;
        let achieved = &rows.scratch.achieved_pairs[..elements];
        let desired = &rows.scratch.desired_pairs[..elements];
        let pairs = GoalPairs::new(achieved, desired, goal_dim)?;
        // NaN and `false` reveal a reward function that leaves elements out.
        refill(&mut workspace.rewards, counts.pairs, f64::NAN)?;
        reward.reward_batch(pairs, &mut workspace.rewards)?;
        let termination = sampler.termination();
        if termination != Termination::Stored {
            refill(&mut workspace.terminated, counts.pairs, false)?;
            reward.terminated_batch(pairs, &mut workspace.terminated)?;
            let keeps_stored = termination == Termination::StoredOrRecomputed;
            terminate(storage, form, counts, rows, &workspace.terminated, keeps_stored);
        }
        put_rewards(sampler, counts, rows, &workspace.rewards)?;
    }
    if sampler.success() { judge(storage.layout.dims().goal, reward, rows) } else { Ok(()) }
}

/// Ends each relabeled window at the first step with which the new goal ends the task.
/// `keeps_stored` says whether the last step also ends the task where the stored one does.
fn terminate<S: Scalar, T: Scalar>(
    storage: &Storage<S>,
    form: impl Form<S, T>,
    counts: Counts,
    rows: &mut Rows<'_, T>,
    terminated: &[bool],
    keeps_stored: bool,
) {
    let Storage { layout, tape, episodes, .. } = storage;
    // Taken out, because the rows change while the goals are read.
    let desired_pairs = std::mem::take(&mut rows.scratch.desired_pairs);
    let goal_dim = layout.dims().goal;
    let mut first = 0;
    let mut rest = terminated;
    for at in 0..counts.rows {
        let Relabeled { row, pairs, .. } = rows.scratch.relabeled[at];
        let desired_goal = &desired_pairs[first * goal_dim..][..goal_dim];
        first += pairs;
        let (terminated, later) = rest.split_at(pairs);
        rest = later;
        let end = terminated.iter().position(|terminated| *terminated);
        rows.columns.terminated[row] =
            end.is_some() || keeps_stored && rows.columns.terminated[row];
        let Some(used) = end.map(|end| end + 1).filter(|used| *used < pairs) else {
            continue;
        };
        rows.scratch.relabeled[at].used = used;
        rows.columns.truncated[row] = false;
        let transition = rows.columns.transition[row].number();
        let next = tape.row(episodes.of(transition).row(transition) + used as u64);
        form.put_next(rows, row, State { layout, row: next }, desired_goal);
    }
    rows.scratch.desired_pairs = desired_pairs;
}

/// Puts the rewards of the windows, once their lengths are final, into the relabeled rows.
fn put_rewards<T: Scalar>(
    sampler: &Sampler,
    counts: Counts,
    rows: &mut Rows<'_, T>,
    rewards: &[f64],
) -> Result<(), SampleError> {
    let Rows { columns, scratch, .. } = rows;
    let mut rest = rewards;
    for Relabeled { row, pairs, used } in &scratch.relabeled[..counts.rows] {
        let (rewards, later) = rest.split_at(*pairs);
        rest = later;
        let mut value = rewards[0];
        if let Some(n_step) = sampler.n_step() {
            let (sum, discount) = n_step.sum(rewards[..*used].iter().copied());
            value = sum;
            let discount = if columns.terminated[*row] { 0.0 } else { discount };
            columns.discount[*row] = T::from_f64(discount);
        }
        let rounded = T::from_f64(value);
        if !rounded.to_f64().is_finite() {
            return Err(SampleError::RewardNotFinite { row: *row, reward: value });
        }
        columns.reward[*row] = rounded;
    }
    Ok(())
}

/// Computes the success of all rows, from the goals as they are stored.
fn judge<T: Scalar>(
    goal_dim: usize,
    reward: &dyn GoalReward,
    rows: &mut Rows<'_, T>,
) -> Result<(), SampleError> {
    let Rows { columns, scratch, .. } = rows;
    let (mut achieved, mut desired) = (&*scratch.judged_achieved, &*scratch.judged_desired);
    if achieved.is_empty() {
        let len = columns.desired_goal.len();
        widen(&mut scratch.achieved_pairs[..len], columns.next_achieved_goal);
        widen(&mut scratch.desired_pairs[..len], columns.desired_goal);
        (achieved, desired) = (&scratch.achieved_pairs[..len], &scratch.desired_pairs[..len]);
    }
    let pairs = GoalPairs::new(achieved, desired, goal_dim)?;
    Ok(reward.is_success_batch(pairs, columns.success)?)
}

/// Computes the importance weights of the gathered rows, with the exponent `beta`.
pub(crate) fn weigh<S: Scalar, T: Scalar>(
    beta: UnitInterval,
    storage: &Storage<S>,
    rows: &mut Rows<'_, T>,
    workspace: &mut Workspace,
) -> Result<(), SampleError> {
    let Some(table) = &storage.priorities else { return Ok(()) };
    let columns = &mut rows.columns;
    refill(&mut workspace.shares, columns.transition.len(), 0.0)?;
    for (probability, id) in workspace.shares.iter_mut().zip(&*columns.transition) {
        *probability = share(table, &storage.episodes, id.number());
    }
    let least = workspace.shares.iter().copied().fold(f64::INFINITY, f64::min);
    for (weight, share) in columns.importance_weight.iter_mut().zip(&workspace.shares) {
        // The least probable row has the highest weight, by which all are divided.
        *weight = T::from_f64((least / share).powf(beta.get()));
    }
    Ok(())
}

/// Returns a number proportional to the probability of drawing a live transition.
fn share(table: &PriorityTable, episodes: &Episodes, transition: u64) -> f64 {
    match table.settings.unit() {
        PriorityUnit::Transition => table.tree.weight(transition),
        PriorityUnit::Episode => {
            let episode = episodes.of(transition);
            let len = (episode.end - episode.start) as f64;
            // Even the smallest positive number must not become 0.
            (table.tree.weight(episode.number) / len).max(f64::MIN_POSITIVE)
        }
    }
}
