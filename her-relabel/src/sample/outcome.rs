//! The outcomes of drawn rows: rewards, termination, success and importance weights.

use goal_reward::{GoalPairs, GoalReward};

use crate::sample::batch::{Batch, Relabeled};
use crate::sample::columns::{put_part, widen};
use crate::sample::gather::Counts;
use crate::sample::sampler::{SampleError, Sampler};
use crate::scalar::Scalar;
use crate::store::episodes::Episodes;
use crate::store::priorities::PriorityUnit;
use crate::store::priority_table::PriorityTable;
use crate::store::storage::Storage;
use crate::unit_interval::UnitInterval;

/// Computes everything in the gathered rows that depends on their goals.
pub(crate) fn compute<T: Scalar, F: GoalReward + ?Sized>(
    storage: &Storage<T>,
    sampler: &Sampler,
    reward: &F,
    counts: Counts,
    batch: &mut Batch<T>,
) -> Result<(), SampleError> {
    if counts.rows > 0 {
        let goal_dim = storage.layout.dims().goal;
        let Batch { scratch, judged, .. } = &mut *batch;
        let elements = counts.pairs * goal_dim;
        let achieved = &scratch.achieved_pairs[..elements];
        let desired = &scratch.desired_pairs[..elements];
        let pairs = GoalPairs::new(achieved, desired, goal_dim)?;
        // NaN and `false` reveal a reward function that leaves elements out.
        judged.rewards.clear();
        judged.rewards.resize(counts.pairs, f64::NAN);
        reward.reward_batch(pairs, &mut judged.rewards)?;
        if sampler.recompute_terminated() {
            judged.terminated.clear();
            judged.terminated.resize(counts.pairs, false);
            reward.terminated_batch(pairs, &mut judged.terminated)?;
            terminate(storage, counts, batch);
        }
        put_rewards(sampler, counts, batch)?;
    }
    if sampler.success() { judge(storage, reward, batch) } else { Ok(()) }
}

/// Ends each relabeled window at the first step with which the new goal ends the task.
fn terminate<T: Scalar>(storage: &Storage<T>, counts: Counts, batch: &mut Batch<T>) {
    let Batch { columns, scratch, judged, .. } = batch;
    let Storage { layout, tape, episodes, .. } = storage;
    let mut rest = &judged.terminated[..];
    for relabeled in &mut scratch.relabeled[..counts.rows] {
        let (terminated, later) = rest.split_at(relabeled.pairs);
        rest = later;
        let row = relabeled.row;
        let end = terminated.iter().position(|terminated| *terminated);
        columns.terminated[row] = end.is_some();
        let Some(used) = end.map(|end| end + 1).filter(|used| *used < relabeled.pairs) else {
            continue;
        };
        relabeled.used = used;
        columns.truncated[row] = false;
        let transition = columns.transition[row].number();
        let next = tape.row(episodes.of(transition).row(transition) + used as u64);
        put_part(&mut columns.next_observation, row, &next[layout.observation()]);
        put_part(&mut columns.next_achieved_goal, row, &next[layout.achieved_goal()]);
    }
}

/// Puts the rewards of the windows, once their lengths are final, into the relabeled rows.
fn put_rewards<T: Scalar>(
    sampler: &Sampler,
    counts: Counts,
    batch: &mut Batch<T>,
) -> Result<(), SampleError> {
    let Batch { columns, scratch, judged, .. } = batch;
    let mut rest = &judged.rewards[..];
    for Relabeled { row, pairs, used } in &scratch.relabeled[..counts.rows] {
        let (rewards, later) = rest.split_at(*pairs);
        rest = later;
        let mut value = rewards[0];
        if let Some(n_step) = sampler.n_step() {
            let (sum, discount) = n_step.sum(rewards[..*used].iter().copied());
            value = sum;
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

/// Computes the success of all rows.
fn judge<T: Scalar, F: GoalReward + ?Sized>(
    storage: &Storage<T>,
    reward: &F,
    batch: &mut Batch<T>,
) -> Result<(), SampleError> {
    let Batch { columns, scratch, .. } = batch;
    let len = columns.desired_goal.len();
    let achieved = &mut scratch.achieved_pairs[..len];
    let desired = &mut scratch.desired_pairs[..len];
    widen(achieved, &columns.next_achieved_goal);
    widen(desired, &columns.desired_goal);
    let pairs = GoalPairs::new(achieved, desired, storage.layout.dims().goal)?;
    Ok(reward.is_success_batch(pairs, &mut columns.success)?)
}

/// Computes the importance weights of the gathered rows, with the exponent `beta`.
pub(crate) fn weigh<T: Scalar>(beta: UnitInterval, storage: &Storage<T>, batch: &mut Batch<T>) {
    let Some(table) = &storage.priorities else { return };
    let Batch { columns, judged, .. } = batch;
    let shares = columns.transition.iter().map(|id| share(table, &storage.episodes, id.number()));
    judged.shares.clear();
    judged.shares.extend(shares);
    let least = judged.shares.iter().copied().fold(f64::INFINITY, f64::min);
    for (weight, share) in columns.importance_weight.iter_mut().zip(&judged.shares) {
        // The least probable row has the highest weight, by which all are divided.
        *weight = T::from_f64((least / share).powf(beta.get()));
    }
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
