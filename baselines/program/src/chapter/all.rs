//! `all`: runs the chapter's pipeline.

use std::path::PathBuf;

use super::{
    describe::{self, describe},
    random_episodes::{self, random_episodes},
    reward_check::reward_check,
};
use crate::shared::env_id::StartArgs;

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    start: StartArgs,
    /// Where to write the description
    #[arg(long, value_name = "FILE", default_value = describe::OUT)]
    describe_out: PathBuf,
    /// Where to write the random baseline's metrics
    #[arg(long, value_name = "FILE", default_value = random_episodes::OUT)]
    random_out: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let start = args.start;
    let described = describe(start, &args.describe_out)?;
    let agreed = reward_check(start.env_id, start.seed)? == 0;
    let measured = random_episodes(start, random_episodes::EPISODES, &args.random_out)?;
    Ok(described && agreed && measured)
}
