//! `bridge`: the bridging proof of section 2.8.

use fetch_env::make;

use super::rewards::{Comparison, RewardArgs};

const STEPS: usize = 100;
const GOALS_PER_STEP: usize = 5;
const TOLERANCE: f64 = 1e-10;

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    rewards: RewardArgs,
    /// Seed of resets, actions and goals
    #[arg(long, default_value_t = 42)]
    seed: u64,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let (id, seed) = (args.rewards.env_id, args.seed);
    say!("Environment Anatomy -- Bridging Proof")?;
    say!("=====================================")?;
    say!("Env: {id}, seed={seed}, steps={STEPS}")?;
    say!("Relabeled goals per step: {GOALS_PER_STEP}")?;
    say!("Tolerance: atol={TOLERANCE:e}\n")?;

    let comparison =
        Comparison { steps: STEPS, goals_per_step: GOALS_PER_STEP, tolerance: TOLERANCE };
    let mismatches = comparison.run(&mut make(id)?, seed)?;
    let relabeled = STEPS * GOALS_PER_STEP;
    let counts = [
        ("bridge/step-checks", STEPS),
        ("bridge/step-mismatches", mismatches.steps),
        ("bridge/relabel-checks", relabeled),
        ("bridge/relabel-mismatches", mismatches.goals),
    ];
    args.rewards.write_counts(seed, counts)?;
    say!("Step reward checks:    {STEPS} steps, mismatches={}", mismatches.steps)?;
    say!("Relabel reward checks: {relabeled} checks, mismatches={}\n", mismatches.goals)?;
    if mismatches.steps + mismatches.goals > 0 {
        say!("[MISMATCH] Some rewards differ by more than atol={TOLERANCE:e}\n")?;
        say!("[BRIDGE FAILED]")?;
        return Ok(false);
    }
    say!("[MATCH] All rewards match within atol={TOLERANCE:e}")?;
    say!("  manual_reward == compute_reward == step_reward  ({STEPS} steps)")?;
    say!("  relabel_reward == reward(ag, random_goal)  ({relabeled} checks)\n")?;
    say!("[BRIDGE OK] Bridging proof passed")?;
    Ok(true)
}
