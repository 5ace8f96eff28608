//! The flags of the commands: `--env-id`, and those that `bridge` and `reward-check` share.

use std::path::PathBuf;

use fetch_env::{EnvId, MakeError};
use fetch_sim::Task;
use goal_reward::RewardKind;
use lexopt::{Arg::Long, Parser, ValueExt};
use serde_json::json;

use crate::json::{Metric, write_results};

/// FetchReachDense-v4, the chapter's environment.
pub(crate) const DENSE_REACH: EnvId = EnvId { task: Task::Reach, reward: RewardKind::Dense };

/// Parses an environment id, or `auto`: FetchReachDense-v4, as in the chapter.
///
/// # Errors
/// There is no such environment.
pub fn parse_env_id(text: &str) -> Result<EnvId, MakeError> {
    if text == "auto" { Ok(DENSE_REACH) } else { text.parse() }
}

/// The flags `--env-id`, `--seed` and `--json` of a command that compares rewards.
pub(crate) struct Flags {
    pub(crate) id: EnvId,
    pub(crate) seed: u64,
    json: Option<PathBuf>,
}

/// The usage of these flags, given the default of `--seed`.
macro_rules! usage {
    ($seed:literal) => {
        concat!(
            "[--env-id <ID>] [--seed <N>] [--json <FILE>]

  --env-id <ID>  Environment, or auto for FetchReachDense-v4 [default: auto]
  --seed <N>     Seed of resets, actions and goals [default: ",
            $seed,
            "]
  --json <FILE>  Also write the figures as JSON"
        )
    };
}
pub(crate) use usage;

impl Flags {
    /// Parses the flags; `seed` is the default of `--seed`.
    pub(crate) fn parse(mut arguments: Parser, seed: u64) -> anyhow::Result<Self> {
        let mut flags = Self { id: DENSE_REACH, seed, json: None };
        while let Some(argument) = arguments.next()? {
            match argument {
                Long("env-id") => flags.id = arguments.value()?.parse_with(parse_env_id)?,
                Long("seed") => flags.seed = arguments.value()?.parse()?,
                Long("json") => flags.json = Some(arguments.value()?.into()),
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(flags)
    }

    /// Writes numbers of checks and of mismatches to the file that `--json` names, if it is given.
    pub(crate) fn write_counts<const N: usize>(
        &self,
        counts: [(&str, usize); N],
    ) -> anyhow::Result<()> {
        let results = counts.map(|(name, count)| (name.to_owned(), Metric::count(count)));
        let settings = json!({"env_id": self.id, "seed": self.seed});
        write_results(self.json.as_ref(), settings, results)
    }
}
