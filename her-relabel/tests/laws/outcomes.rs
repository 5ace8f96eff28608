//! The laws of recomputed outcomes and of windows of several steps.

use std::num::NonZeroUsize;

use crate::common::{DIMS, Telling, achieved_goal, add, buffer, observation, reward};
use goal_reward::GoalReward;
use her_relabel::{Batch, GoalStrategy, HerBuffer, NStep, Sampler, UnitInterval};

/// [`Telling`] for a task that ends once its goal is reached.
struct Ending;

impl GoalReward for Ending {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        Telling.reward(achieved_goal, desired_goal)
    }
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal == desired_goal
    }
    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal == desired_goal
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
    let stored = draw(&episodes(), &sampler());
    let with_outcomes = sampler().with_recompute_terminated(true).with_success(true);
    let batch = draw(&episodes(), &with_outcomes);
    assert_eq!(batch.success().len(), batch.len());
    for (row, relabeled) in batch.relabeled().enumerate() {
        let reached = goal(batch.next_achieved_goal(), row) == goal(batch.desired_goal(), row);
        assert_eq!(batch.success()[row], reached);
        let expected = if relabeled { reached } else { stored.terminated()[row] };
        assert_eq!(batch.terminated()[row], expected);
    }
    assert!(batch.relabeled().zip(batch.terminated()).any(|(new, over)| new && *over));
    assert_eq!(batch.truncated(), stored.truncated());
    assert_eq!(batch.reward(), stored.reward());
}

fn n_step(steps: usize, gamma: f64) -> NStep {
    NStep::new(NonZeroUsize::new(steps).unwrap(), UnitInterval::new(gamma).unwrap())
}

#[test]
fn a_window_has_one_goal_and_ends_with_its_episode() {
    for (steps, gamma) in [(1, 0.5), (3, 0.5), (5, 1.0), (100, 0.9)] {
        for recompute in [false, true] {
            let sampler =
                sampler().with_n_step(n_step(steps, gamma)).with_recompute_terminated(recompute);
            let batch = draw(&episodes(), &sampler);
            for row in 0..batch.len() {
                check_window(&batch, row, steps as u32, gamma, recompute);
            }
        }
    }
}

/// Computes a window step by step.
fn check_window(batch: &Batch<f64>, row: usize, steps: u32, gamma: f64, recompute: bool) {
    let (episode, t) = place(batch, row);
    let new_goal = batch.goal_source()[row].is_some().then(|| goal(batch.desired_goal(), row));
    if let Some(source) = batch.goal_source()[row] {
        let ahead = (source.get() - batch.transition()[row].get()) as u32;
        assert_eq!(goal(batch.desired_goal(), row), achieved_goal(episode, t + ahead + 1));
    }
    let (mut sum, mut discount, mut at, mut over) = (0.0, 1.0, t, false);
    while at < LENS[episode as usize].min(t + steps) && !over {
        let achieved = achieved_goal(episode, at + 1);
        sum += discount * new_goal.map_or(reward(episode, at), |g| Telling.reward(&achieved, &g));
        discount *= gamma;
        over = recompute && new_goal == Some(achieved);
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
    assert_eq!(
        batch.terminated()[row],
        if recompute && new_goal.is_some() { over } else { stored }
    );
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

fn place(batch: &Batch<f64>, row: usize) -> (u32, u32) {
    let seen = &batch.observation()[row * DIMS.observation..];
    (seen[0] as u32, seen[1] as u32)
}

fn goal(column: &[f64], row: usize) -> [f64; 3] {
    std::array::from_fn(|at| column[row * DIMS.goal + at])
}
