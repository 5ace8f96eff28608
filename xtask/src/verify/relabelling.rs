//! Section 2.6: rewards for goals that the environment never set.

use baselines::{Policy, RandomPolicy};
use fetch_env::{Env, EnvId, GoalEnv, GoalObservation, MujocoEnv};

use super::goals::{GoalSampler, expected_reward};
use crate::check::Check;

const GOALS: usize = 10;
const TOLERANCE: f64 = 1e-10;

pub fn check(_id: EnvId, env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Vec<Check>> {
    Ok(vec![arbitrary_goals(env, seed)?])
}

fn arbitrary_goals(env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Check> {
    let mut policy = RandomPolicy::new(seed);
    let mut goals = GoalSampler::new(seed);
    let first = env.reset(Some(seed))?.observation;
    let observation = env.step(&policy.act(&first))?.observation;
    let achieved = observation.achieved_goal();
    let mut mismatches = 0;
    // Far goals, goals about the threshold, and the achieved goal itself.
    let mut arbitrary: Vec<[f64; 3]> = (0..GOALS).map(|_| goals.sample()).collect();
    arbitrary.extend((0..GOALS).map(|_| goals.sample_near(achieved, 0.05)));
    for goal in arbitrary.iter().map(<[f64; 3]>::as_slice).chain([achieved]) {
        let expected = expected_reward(env.goal_reward(), achieved, goal);
        if (env.compute_reward(achieved, goal)? - expected).abs() > TOLERANCE {
            mismatches += 1;
        }
    }
    let seen =
        format!("{} arbitrary goals, {mismatches} mismatches at {TOLERANCE:e}", 2 * GOALS + 1);
    Ok(Check::none_of("relabel/arbitrary-goals", mismatches, seen))
}
