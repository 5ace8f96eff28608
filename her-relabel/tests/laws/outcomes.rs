//! The laws of recomputed outcomes and of windows of several steps.

use std::num::NonZeroUsize;

use crate::common::{
    DIMS, Result, Telling, achieved_goal, add, begin, buffer, observation, reward,
};
use goal_reward::GoalReward;
use her_relabel::{
    Batch, GoalMixture, GoalStrategy, HerBuffer, NStep, Sampler, StepData, Termination,
    UnitInterval,
};

/// [`Telling`] for a task that ends once its goal is reached, and that distinguishes the achieved
/// goal from the desired one: a state reaches the states of its episode that are not later.
struct Ending;

impl GoalReward for Ending {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        Telling.reward(achieved_goal, desired_goal)
    }
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal[0] == desired_goal[0] && achieved_goal[1] >= desired_goal[1]
    }
    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.is_success(achieved_goal, desired_goal)
    }
}

fn sampler() -> Sampler {
    Sampler::new(2000, GoalStrategy::Future, UnitInterval::from_k(1))
}

fn draw(buffer: &HerBuffer<f64>, sampler: &Sampler) -> Batch<f64> {
    let mut batch = Batch::<f64>::new();
    sampler.sample(buffer, &Ending, 1, &mut batch).unwrap();
    batch
}

fn episodes() -> HerBuffer<f64> {
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 4, (true, false));
    add(&mut buffer, 2, 1, (true, true));
    add(&mut buffer, 3, 7, (false, true));
    buffer
}

const LENS: [u32; 4] = [0, 4, 1, 7];

#[test]
fn outcomes_are_as_stored_unless_requested() {
    let batch = draw(&episodes(), &sampler());
    assert!(batch.success().is_empty() && batch.discount().is_empty());
    for row in 0..batch.len() {
        let (episode, t) = place(&batch, row);
        let is_last = t + 1 == LENS[episode as usize];
        assert_eq!(batch.terminated()[row], is_last && episode != 3);
        assert_eq!(batch.truncated()[row], is_last && episode != 1);
    }
}

#[test]
fn termination_and_success_are_those_of_the_new_goal() {
    // Of goals from the whole buffer, some are never reached.
    let plain = sampler().with_goals(GoalMixture::only(GoalStrategy::Random));
    let stored = draw(&episodes(), &plain);
    let recomputed = plain.with_termination(Termination::Recomputed).with_success(true);
    let batch = draw(&episodes(), &recomputed);
    let added = draw(&episodes(), &plain.with_termination(Termination::StoredOrRecomputed));
    assert_eq!(batch.success().len(), batch.len());
    for (row, relabeled) in batch.relabeled().enumerate() {
        let (achieved, desired) =
            (goal(batch.next_achieved_goal(), row), goal(batch.desired_goal(), row));
        let reached = Ending.is_success(&achieved, &desired);
        assert_eq!(batch.success()[row], reached);
        let expected = if relabeled { reached } else { stored.terminated()[row] };
        assert_eq!(batch.terminated()[row], expected);
        let either = reached && relabeled || stored.terminated()[row];
        assert_eq!(added.terminated()[row], either);
    }
    assert!(batch.relabeled().zip(batch.terminated()).any(|(new, over)| new && *over));
    // Some rows that ended the task no longer do, which is right only where tasks end at their
    // goals.
    assert!(stored.terminated().iter().zip(batch.terminated()).any(|(old, new)| *old && !*new));
    assert_eq!(batch.truncated(), stored.truncated());
    assert_eq!(batch.reward(), stored.reward());
}

#[test]
fn rewards_of_rows_that_keep_their_goal_are_recomputed_if_requested() {
    let stored = draw(&episodes(), &sampler());
    let batch = draw(&episodes(), &sampler().with_recomputed_rewards(true));
    for (row, relabeled) in batch.relabeled().enumerate() {
        let (achieved, desired) =
            (goal(batch.next_achieved_goal(), row), goal(batch.desired_goal(), row));
        assert_eq!(batch.reward()[row], Ending.reward(&achieved, &desired));
        assert_eq!(batch.reward()[row] == stored.reward()[row], relabeled);
    }
    assert_eq!(batch.terminated(), stored.terminated());
    assert_eq!(batch.transition(), stored.transition());
}

fn n_step(steps: usize, gamma: f64) -> NStep {
    NStep::new(NonZeroUsize::new(steps).unwrap(), UnitInterval::new(gamma).unwrap())
}

#[test]
fn a_window_has_one_goal_and_ends_with_its_episode() {
    for (steps, gamma) in [(1, 0.5), (3, 0.5), (5, 1.0), (100, 0.9)] {
        for termination in
            [Termination::Stored, Termination::StoredOrRecomputed, Termination::Recomputed]
        {
            for strategy in [GoalStrategy::Future, GoalStrategy::Random] {
                let sampler =
                    sampler().with_goals(GoalMixture::only(strategy)).with_termination(termination);
                let batch = draw(&episodes(), &sampler.with_n_step(n_step(steps, gamma)));
                for row in 0..batch.len() {
                    check_window(&batch, row, steps as u32, gamma, termination);
                }
            }
        }
    }
}

/// Computes a window step by step.
fn check_window(batch: &Batch<f64>, row: usize, steps: u32, gamma: f64, termination: Termination) {
    let (episode, t) = place(batch, row);
    let new_goal = batch.goal_source()[row].map(|source| {
        // The transitions are numbered from 1.
        let (episode, first) = match source.get() {
            1..=4 => (1, 1),
            5 => (2, 5),
            _ => (3, 6),
        };
        let new_goal = goal(batch.desired_goal(), row);
        assert_eq!(new_goal, achieved_goal(episode, (source.get() - first) as u32 + 1));
        new_goal
    });
    let (mut sum, mut discount, mut at, mut over) = (0.0, 1.0, t, false);
    while at < LENS[episode as usize].min(t + steps) && !over {
        let achieved = achieved_goal(episode, at + 1);
        sum += discount * new_goal.map_or(reward(episode, at), |g| Telling.reward(&achieved, &g));
        discount *= gamma;
        over = termination != Termination::Stored
            && new_goal.is_some_and(|goal| Ending.terminated(&achieved, &goal));
        at += 1;
    }
    let is_last = at == LENS[episode as usize];
    let stored = is_last && episode != 3;
    assert!((batch.reward()[row] - sum).abs() < 1e-9 * sum.abs());
    // Nothing follows where the task ended.
    let discount = if batch.terminated()[row] { 0.0 } else { discount };
    assert_eq!(batch.discount()[row], discount);
    assert_eq!(batch.next_observation()[row * DIMS.observation..][..2], observation(episode, at));
    assert_eq!(goal(batch.next_achieved_goal(), row), achieved_goal(episode, at));
    let expected = match (termination, new_goal) {
        (Termination::Recomputed, Some(_)) => over,
        _ => over || stored,
    };
    assert_eq!(batch.terminated()[row], expected);
    assert_eq!(batch.truncated()[row], is_last && episode != 1);
}

#[test]
fn a_window_of_one_step_is_the_transition() {
    let single = draw(&episodes(), &sampler());
    let batch = draw(&episodes(), &sampler().with_n_step(n_step(1, 0.97)));
    assert_eq!(batch.reward(), single.reward());
    assert_eq!(batch.next_observation(), single.next_observation());
    for (discount, terminated) in batch.discount().iter().zip(batch.terminated()) {
        assert_eq!(*discount, if *terminated { 0.0 } else { 0.97 });
    }
}

#[test]
fn a_return_of_one_reward_keeps_its_bits() -> Result {
    let mut buffer = buffer(10);
    begin(&mut buffer, 0, 1)?;
    let step = StepData {
        action: &[0.0],
        reward: -0.0,
        next_observation: &observation(1, 1),
        next_achieved_goal: &achieved_goal(1, 1),
        terminated: false,
        truncated: true,
        fields: &[],
    };
    buffer.add_step(0, &step)?;
    let sampler = sampler().with_ratio(UnitInterval::ZERO);
    for sampler in
        [sampler, sampler.with_n_step(n_step(1, 0.5)), sampler.with_n_step(n_step(9, 0.5))]
    {
        let batch = draw(&buffer, &sampler);
        assert!(batch.reward().iter().all(|reward| reward.to_bits() == (-0.0_f64).to_bits()));
    }
    Ok(())
}

fn place(batch: &Batch<f64>, row: usize) -> (u32, u32) {
    let seen = &batch.observation()[row * DIMS.observation..];
    (seen[0] as u32, seen[1] as u32)
}

fn goal(column: &[f64], row: usize) -> [f64; 3] {
    std::array::from_fn(|at| column[row * DIMS.goal + at])
}
