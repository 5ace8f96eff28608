//! `reward-check`: step, compute_reward and the formula agree, relabeled goals included.

use std::path::PathBuf;

use baselines::{Policy, RandomPolicy};
use fetch_env::{Env, EnvId, GoalEnv, GoalEnvExt, GoalObservation, make_with_config};

use crate::{
    env_choice::EnvArgs,
    report::{EnvSettings, Figure, Report, write_json},
    verify::goals::{GoalSampler, expected_reward},
};

const TOLERANCE: f64 = 1e-6;
const STEPS: usize = 500;
const RANDOM_GOALS: usize = 3;

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    env: EnvArgs,
    /// Also write the figures as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let (id, seed) = (args.env.id(), args.env.seed);
    let mismatches = reward_check(id, seed)?;
    if let Some(path) = &args.json {
        let count = |name: &str, value| (format!("reward-check/{name}"), Figure::count(value));
        let checks = STEPS * (1 + RANDOM_GOALS);
        let results = [count("checks", checks), count("mismatches", mismatches)];
        write_json(path, &Report::new(EnvSettings { env_id: id, seed }, results))?;
    }
    Ok(mismatches == 0)
}

/// Runs the check, prints its line and returns how often it did not hold.
pub fn reward_check(id: EnvId, seed: u64) -> anyhow::Result<usize> {
    let mut env = make_with_config(id.config())?;
    let mut policy = RandomPolicy::new(seed);
    let mut goals = GoalSampler::new(seed);
    let mut observation = env.reset(Some(seed))?.observation;
    let mut mismatches = 0;
    for t in 0..STEPS as u64 {
        let step = env.step(&policy.act(&observation))?;
        observation = step.observation;
        let achieved = observation.achieved_goal();
        let desired = observation.desired_goal();
        let mut agree = |given: f64, goal: &[f64]| -> anyhow::Result<()> {
            let manual = expected_reward(env.goal_reward(), achieved, goal);
            let computed = env.compute_reward(achieved, goal)?;
            if (computed - manual).abs() > TOLERANCE || (given - manual).abs() > TOLERANCE {
                mismatches += 1;
            }
            Ok(())
        };
        agree(step.reward, desired)?;
        for _ in 0..RANDOM_GOALS {
            let goal = goals.sample();
            agree(env.compute_reward(achieved, &goal)?, &goal)?;
        }
        if step.is_last() {
            observation = env.reset(Some(seed + t + 1))?.observation;
        }
    }
    let settings = format!("atol={TOLERANCE:e}, n_steps={STEPS}, n_random_goals={RANDOM_GOALS}");
    if mismatches > 0 {
        println!("FAIL: reward checks of {id}: {mismatches} mismatches ({settings})");
    } else {
        println!("OK: reward checks passed ({settings})");
    }
    Ok(mismatches)
}
