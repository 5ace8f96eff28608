//! `all`: runs the chapter's pipeline.

use std::path::PathBuf;

use fetch_env::EnvId;

use super::{
    describe::{self, describe},
    random_episodes::{self, random_episodes},
    reward_check::reward_check,
};
use crate::shared::env_id::parse_env_id;

#[derive(clap::Args)]
pub struct Args {
    /// Environment, or auto for FetchReachDense-v4
    #[arg(long, value_name = "ID", default_value = "auto", value_parser = parse_env_id)]
    env_id: EnvId,
    /// Seed of resets, actions and goals
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Where to write the description
    #[arg(long, value_name = "FILE", default_value = describe::OUT)]
    describe_out: PathBuf,
    /// Where to write the random baseline's metrics
    #[arg(long, value_name = "FILE", default_value = random_episodes::OUT)]
    random_out: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let (id, seed) = (args.env_id, args.seed);
    let described = describe(id, seed, &args.describe_out)?;
    let agreed = reward_check(id, seed)? == 0;
    let measured = random_episodes(id, seed, random_episodes::EPISODES, &args.random_out)?;
    Ok(described && agreed && measured)
}
