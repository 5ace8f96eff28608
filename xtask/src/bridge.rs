//! `bridge`: the bridging proof of section 2.8.

use std::path::PathBuf;

use baselines::{Policy, RandomPolicy};
use fetch_env::{Env, GoalEnv, GoalEnvExt, GoalObservation, make_with_config};

use crate::{
    env_choice::EnvChoice,
    report::{EnvSettings, Figure, Report, write_json},
    verify::goals::{GoalSampler, expected_reward},
};

const STEPS: usize = 100;
const GOALS_PER_STEP: usize = 5;
const TOLERANCE: f64 = 1e-10;

#[derive(clap::Args)]
pub struct Args {
    /// Environment, or auto for FetchReachDense-v4
    #[arg(long, default_value_t = EnvChoice::Auto)]
    env_id: EnvChoice,
    /// Seed of resets, actions and goals
    #[arg(long, default_value_t = 42)]
    seed: u64,
    /// Also write the figures as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let id = args.env_id.id();
    let seed = args.seed;
    println!("Environment Anatomy -- Bridging Proof");
    println!("=====================================");
    println!("Env: {id}, seed={seed}, steps={STEPS}");
    println!("Relabeled goals per step: {GOALS_PER_STEP}");
    println!("Tolerance: atol={TOLERANCE:e}\n");

    let mut env = make_with_config(id.config())?;
    let mut policy = RandomPolicy::new(seed);
    let mut goals = GoalSampler::new(seed);
    let mut observation = env.reset(Some(seed))?.observation;
    let (mut step_mismatches, mut relabel_mismatches) = (0, 0);
    for t in 0..STEPS as u64 {
        let step = env.step(&policy.act(&observation))?;
        observation = step.observation;
        let achieved = observation.achieved_goal();
        let manual = expected_reward(env.goal_reward(), achieved, observation.desired_goal());
        let computed = env.compute_reward(achieved, observation.desired_goal())?;
        if (manual - computed).abs() > TOLERANCE || (manual - step.reward).abs() > TOLERANCE {
            step_mismatches += 1;
        }
        for _ in 0..GOALS_PER_STEP {
            let goal = goals.sample();
            let manual = expected_reward(env.goal_reward(), achieved, &goal);
            if (env.compute_reward(achieved, &goal)? - manual).abs() > TOLERANCE {
                relabel_mismatches += 1;
            }
        }
        if step.is_last() {
            observation = env.reset(Some(seed + t + 1))?.observation;
        }
    }

    let relabeled = STEPS * GOALS_PER_STEP;
    if let Some(path) = &args.json {
        let count = |name: &str, value| (format!("bridge/{name}"), Figure::count(value));
        let results = [
            count("step-checks", STEPS),
            count("step-mismatches", step_mismatches),
            count("relabel-checks", relabeled),
            count("relabel-mismatches", relabel_mismatches),
        ];
        write_json(path, &Report::new(EnvSettings { env_id: id, seed }, results))?;
    }
    println!("Step reward checks:    {STEPS} steps, mismatches={step_mismatches}");
    println!("Relabel reward checks: {relabeled} checks, mismatches={relabel_mismatches}\n");
    if step_mismatches + relabel_mismatches > 0 {
        println!("[MISMATCH] Some rewards differ by more than atol={TOLERANCE:e}\n");
        println!("[BRIDGE FAILED]");
        return Ok(false);
    }
    println!("[MATCH] All rewards match within atol={TOLERANCE:e}");
    println!("  manual_reward == compute_reward == step_reward  ({STEPS} steps)");
    println!("  relabel_reward == reward(ag, random_goal)  ({relabeled} checks)\n");
    println!("[BRIDGE OK] Bridging proof passed");
    Ok(true)
}
