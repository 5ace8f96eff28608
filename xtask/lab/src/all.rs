//! `all`: runs the chapter's pipeline.

use std::path::PathBuf;

use crate::{
    describe::describe, random_episodes::random_episodes, reward_check::reward_check,
    shared::choice::EnvArgs,
};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    env: EnvArgs,
    /// Where to write the description
    #[arg(long, default_value = "results/ch01_env_describe.json")]
    describe_out: PathBuf,
    /// Where to write the random baseline's metrics
    #[arg(long, default_value = "results/ch01_random_metrics.json")]
    random_out: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let id = args.env.env_id;
    let described = describe(id, args.env.seed, &args.describe_out)?;
    let agreed = reward_check(id, args.env.seed)? == 0;
    let measured = random_episodes(id, args.env.seed, 10, &args.random_out)?;
    Ok(described && agreed && measured)
}
