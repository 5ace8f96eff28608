//! Compares the rewards of steps, of `compute_reward` and of the formula, also for goals that the
//! environment never set.

use std::path::PathBuf;

use baselines::{Policy, RandomPolicy};
use fetch_env::{Env, EnvId, GoalEnv, GoalEnvExt, GoalObservation, MujocoEnv};
use goal_reward::{DistanceReward, RewardKind};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use crate::shared::{
    env_id::parse_env_id,
    json::{Metric, write_results},
};

/// The flags of a command that compares rewards, beside `--seed`, which has a default of its own in
/// each.
#[derive(clap::Args)]
pub struct RewardArgs {
    /// Environment, or auto for FetchReachDense-v4
    #[arg(long, value_name = "ID", default_value = "auto", value_parser = parse_env_id)]
    pub(crate) env_id: EnvId,
    /// Also write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl RewardArgs {
    /// Writes numbers of checks and of mismatches to the file that `--json` names, if it is given.
    pub(crate) fn write_counts<const N: usize>(
        &self,
        seed: u64,
        counts: [(&str, usize); N],
    ) -> anyhow::Result<()> {
        let results = counts.map(|(name, count)| (name.to_owned(), Metric::count(count)));
        let settings = json!({"env_id": self.env_id, "seed": seed});
        write_results(self.json.as_ref(), settings, results)
    }
}

/// Draws goals uniformly from the chapter's workspace and a margin around it.
pub(crate) struct GoalSampler {
    generator: ChaCha8Rng,
}

impl GoalSampler {
    pub(crate) fn new(seed: u64) -> Self {
        // The random policy uses the stream of the plain seed.
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(1);
        Self { generator }
    }

    pub(crate) fn sample(&mut self) -> [f64; 3] {
        [(1.0, 1.6), (0.4, 1.1), (0.3, 0.9)]
            .map(|(low, high)| self.generator.random_range(low..high))
    }

    /// Draws a goal within `radius` meters of a point along each axis.
    pub(crate) fn sample_near(&mut self, point: &[f64], radius: f64) -> [f64; 3] {
        std::array::from_fn(|axis| point[axis] + self.generator.random_range(-radius..radius))
    }
}

/// Returns the reward by the chapter's formula, which is written out here to be independent of
/// goal-reward.
fn expected_reward(reward: &DistanceReward, achieved: &[f64], desired: &[f64]) -> f64 {
    let squares: f64 = achieved.iter().zip(desired).map(|(a, d)| (a - d) * (a - d)).sum();
    let distance = squares.sqrt();
    match reward.kind() {
        RewardKind::Dense => -distance,
        RewardKind::Sparse if distance <= reward.threshold().get() => 0.0,
        RewardKind::Sparse => -1.0,
    }
}

/// Returns whether the formula gives the reward of `compute_reward`, within a tolerance, and that
/// of the step if the goal was the step's.
pub(crate) fn formula_agrees(
    env: &MujocoEnv,
    achieved: &[f64],
    desired: &[f64],
    of_step: Option<f64>,
    tolerance: f64,
) -> anyhow::Result<bool> {
    let expected = expected_reward(env.goal_reward(), achieved, desired);
    let near = |reward: f64| (reward - expected).abs() <= tolerance;
    Ok(near(env.compute_reward(achieved, desired)?) && of_step.is_none_or(near))
}

/// How the rewards of random steps are compared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Comparison {
    pub(crate) steps: usize,
    /// Arbitrary goals at each step.
    pub(crate) goals_per_step: usize,
    pub(crate) tolerance: f64,
}

/// The numbers of wrong rewards.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Mismatches {
    /// Steps at which step, `compute_reward` and formula do not agree.
    pub(crate) steps: usize,
    /// Arbitrary goals for which `compute_reward` and formula do not agree.
    pub(crate) goals: usize,
    /// Steps whose reward differs from `compute_reward`'s in any bit.
    pub(crate) bits: usize,
    /// Steps whose reward is impossible: positive, or neither 0 nor -1 if it is sparse.
    pub(crate) range: usize,
}

impl Comparison {
    /// Takes random steps and compares their rewards.
    pub(crate) fn run(self, env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Mismatches> {
        let Self { steps, goals_per_step, tolerance } = self;
        let (mut policy, mut action) = (RandomPolicy::new(env.action_space(), seed), [0.0; 4]);
        let mut goals = GoalSampler::new(seed);
        let mut observation = env.reset(Some(seed))?.observation;
        let mut mismatches = Mismatches::default();
        for t in 0..steps as u64 {
            policy.act(&observation, &mut action);
            let step = env.step(&action)?;
            let is_last = step.is_last();
            observation = step.observation;
            let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
            let agree = formula_agrees(env, achieved, desired, Some(step.reward), tolerance)?;
            mismatches.steps += usize::from(!agree);
            let computed = env.compute_reward(achieved, desired)?;
            mismatches.bits += usize::from(computed.to_bits() != step.reward.to_bits());
            let in_range = match env.goal_reward().kind() {
                RewardKind::Dense => step.reward <= 0.0,
                RewardKind::Sparse => step.reward == 0.0 || step.reward == -1.0,
            };
            mismatches.range += usize::from(!in_range);
            for _ in 0..goals_per_step {
                let agree = formula_agrees(env, achieved, &goals.sample(), None, tolerance)?;
                mismatches.goals += usize::from(!agree);
            }
            if is_last {
                observation = env.reset(Some(seed + t + 1))?.observation;
            }
        }
        Ok(mismatches)
    }
}
