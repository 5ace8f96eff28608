//! Sections 2.5 and 2.6: the reward computed in three ways, and for goals that the environment
//! never set.

use baselines::{Policy, RandomPolicy, buffer_config, collect};
use fetch_env::{Env, EnvId, GoalEnv, GoalEnvExt, GoalObservation, MujocoEnv};
use goal_reward::RewardKind;
use her_relabel::{Batch, GoalStrategy, HerBuffer, Sampler, UnitInterval};

use super::super::rewards::{Comparison, GoalSampler, formula_agrees};
use crate::shared::{check::Check, json::Metric};

const STEPS: usize = 100;
const TOLERANCE: f64 = 1e-10;
const GOALS: usize = 10;
const EPISODES: usize = 3;
const BATCH: usize = 1000;

pub(crate) fn check(id: EnvId, env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Vec<Check>> {
    let comparison = Comparison { steps: STEPS, goals_per_step: 0, tolerance: TOLERANCE };
    let found = comparison.run(env, seed)?;
    let threshold = env.goal_reward().threshold().get();
    let range = match id.reward {
        RewardKind::Dense => "non-positive",
        RewardKind::Sparse => "exactly 0 or -1",
    };
    Ok(vec![
        Check::none_of(
            "reward/three-ways",
            found.steps,
            format!(
                "manual = compute_reward = step over {STEPS} steps, {} mismatches at {TOLERANCE:e}",
                found.steps
            ),
        ),
        Check::none_of(
            "reward/law",
            found.bits,
            format!("step reward and compute_reward: {} differ in any bit", found.bits),
        ),
        Check::none_of(
            "reward/range",
            found.range,
            format!("every reward is {range}: {} are not", found.range),
        ),
        Check::new(
            "reward/threshold",
            threshold == 0.05,
            format!("distance_threshold={threshold} m"),
            Metric::new(threshold, "m"),
        ),
        arbitrary_goals(env, seed)?,
        hindsight(env, seed)?,
    ])
}

fn arbitrary_goals(env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Check> {
    let mut policy = RandomPolicy::new(env.action_space(), seed);
    let mut goals = GoalSampler::new(seed);
    let first = env.reset(Some(seed))?.observation;
    let mut action = [0.0; 4];
    policy.act(&first, &mut action);
    let observation = env.step(&action)?.observation;
    let achieved = observation.achieved_goal();
    let mut mismatches = 0;
    // Far goals, goals near the threshold, and the achieved goal itself.
    let mut arbitrary: Vec<[f64; 3]> = (0..GOALS).map(|_| goals.sample()).collect();
    arbitrary.extend((0..GOALS).map(|_| goals.sample_near(achieved, 0.05)));
    for goal in arbitrary.iter().map(<[f64; 3]>::as_slice).chain([achieved]) {
        if !formula_agrees(env, achieved, goal, None, TOLERANCE)? {
            mismatches += 1;
        }
    }
    let count = 2 * GOALS + 1;
    let seen = format!("{count} arbitrary goals, {mismatches} mismatches at {TOLERANCE:e}");
    Ok(Check::none_of("relabel/arbitrary-goals", mismatches, seen))
}

/// Passes random episodes through the replay buffer: every reward of a batch must be the
/// environment's, for original goals and for goals achieved later.
fn hindsight(env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Check> {
    let mut buffer = HerBuffer::<f64>::new(buffer_config(50 * EPISODES, env)?)?;
    let mut policy = RandomPolicy::new(env.action_space(), seed);
    collect(env, &mut policy, EPISODES, seed, &mut buffer, 0, |_| ())?;
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
        "{relabeled} of {BATCH} transitions relabeled with later goals, {mismatches} rewards \
         differ in any bit"
    );
    Ok(Check::none_of("relabel/hindsight", mismatches, seen))
}
