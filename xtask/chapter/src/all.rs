//! `all`: runs the chapter's pipeline.

use std::path::PathBuf;

use commands::Command;
use lexopt::{Arg::Long, Parser, ValueExt};

use crate::{
    choice::{DENSE_REACH, parse_env_id},
    describe::{self, describe},
    random_episodes::{self, random_episodes},
    reward_check::reward_check,
};

pub(crate) const COMMAND: Command = Command {
    name: "all",
    usage: "[--env-id <ID>] [--seed <N>] [--describe-out <FILE>] [--random-out <FILE>]

  --env-id <ID>          Environment, or auto for FetchReachDense-v4 [default: auto]
  --seed <N>             Seed of resets, actions and goals [default: 0]
  --describe-out <FILE>  Where to write the description
                         [default: results/ch01_env_describe.json]
  --random-out <FILE>    Where to write the random baseline's metrics
                         [default: results/ch01_random_metrics.json]",
    run,
};

fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    let (mut id, mut seed) = (DENSE_REACH, 0);
    let mut describe_out = PathBuf::from(describe::OUT);
    let mut random_out = PathBuf::from(random_episodes::OUT);
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("env-id") => id = arguments.value()?.parse_with(parse_env_id)?,
            Long("seed") => seed = arguments.value()?.parse()?,
            Long("describe-out") => describe_out = arguments.value()?.into(),
            Long("random-out") => random_out = arguments.value()?.into(),
            other => return Err(other.unexpected().into()),
        }
    }
    let described = describe(id, seed, &describe_out)?;
    let agreed = reward_check(id, seed)? == 0;
    let measured = random_episodes(id, seed, random_episodes::EPISODES, &random_out)?;
    Ok(described && agreed && measured)
}
