//! `all`: the chapter's pipeline.

use std::path::PathBuf;

use crate::{
    describe::describe, env_choice::EnvChoice, random_episodes::random_episodes,
    reward_check::reward_check,
};

#[derive(clap::Args)]
pub struct Args {
    /// Environment, or auto for FetchReachDense-v4
    #[arg(long, default_value_t = EnvChoice::Auto)]
    env_id: EnvChoice,
    /// Seed of everything
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Where to write the description
    #[arg(long, default_value = "results/ch01_env_describe.json")]
    describe_out: PathBuf,
    /// Where to write the random baseline's metrics
    #[arg(long, default_value = "results/ch01_random_metrics.json")]
    random_out: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let id = args.env_id.id();
    let described = describe(id, args.seed, &args.describe_out)?;
    let agreed = reward_check(id, args.seed)? == 0;
    let measured = random_episodes(id, args.seed, 10, &args.random_out)?;
    Ok(described && agreed && measured)
}
