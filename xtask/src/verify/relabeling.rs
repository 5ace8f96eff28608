//! Section 2.6: rewards for goals that the environment never set.

use baselines::{Policy, RandomPolicy};
use fetch_env::{Env, EnvId, FetchObservation, GoalEnv, GoalObservation, MujocoEnv};
use her_relabel::{
    Batch, BufferConfig, Dims, EpisodeStart, GoalStrategy, HerBuffer, Sampler, Step, UnitInterval,
};

use super::goals::{GoalSampler, expected_reward};
use crate::check::Check;

const GOALS: usize = 10;
const TOLERANCE: f64 = 1e-10;
const EPISODES: usize = 3;
const BATCH: usize = 1000;

pub fn check(_id: EnvId, env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Vec<Check>> {
    Ok(vec![arbitrary_goals(env, seed)?, hindsight(env, seed)?])
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
    let count = 2 * GOALS + 1;
    let seen = format!("{count} arbitrary goals, {mismatches} mismatches at {TOLERANCE:e}");
    Ok(Check::none_of("relabel/arbitrary-goals", mismatches, seen))
}

/// Random episodes through the replay buffer: every reward in a batch is the environment's, for
/// goals left alone and for goals achieved later.
fn hindsight(env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Check> {
    let buffer = collect(env, seed)?;
    let sampler = Sampler::new(BATCH, GoalStrategy::Future, UnitInterval::from_k(4));
    let mut batch = Batch::new();
    sampler.sample(&buffer, env.goal_reward(), seed, &mut batch)?;
    let mut mismatches = 0;
    let goals =
        batch.next_achieved_goal().chunks_exact(3).zip(batch.desired_goal().chunks_exact(3));
    for ((achieved, desired), reward) in goals.zip(batch.reward()) {
        if env.compute_reward(achieved, desired)?.to_bits() != reward.to_bits() {
            mismatches += 1;
        }
    }
    let relabeled = batch.relabeled().filter(|relabeled| *relabeled).count();
    let seen = format!(
        "{relabeled} of {BATCH} transitions relabeled with later goals, {mismatches} rewards differ in any bit"
    );
    Ok(Check::none_of("relabel/hindsight", mismatches, seen))
}

fn collect(env: &mut MujocoEnv, seed: u64) -> anyhow::Result<HerBuffer<f64>> {
    let mut policy = RandomPolicy::new(seed);
    let first = env.reset(Some(seed))?.observation;
    let dims = Dims { observation: first.observation().len(), goal: 3, action: 4 };
    let mut buffer = HerBuffer::new(BufferConfig::new(50 * EPISODES, dims))?;
    for seed in (seed..).take(EPISODES) {
        let mut observation: FetchObservation = env.reset(Some(seed))?.observation;
        buffer.begin_episode(
            0,
            &EpisodeStart {
                observation: observation.observation(),
                achieved_goal: observation.achieved_goal(),
                desired_goal: observation.desired_goal(),
            },
        )?;
        loop {
            let action = policy.act(&observation);
            let step = env.step(&action)?;
            observation = step.observation;
            buffer.add_step(
                0,
                &Step {
                    action: &action.map(f64::from),
                    reward: step.reward,
                    next_observation: observation.observation(),
                    next_achieved_goal: observation.achieved_goal(),
                    terminated: step.terminated,
                    truncated: step.truncated,
                    fields: &[],
                },
            )?;
            if step.is_last() {
                break;
            }
        }
    }
    Ok(buffer)
}
