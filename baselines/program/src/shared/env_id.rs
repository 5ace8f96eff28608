//! The flags `--env-id` and `--seed`.

use fetch_env::{EnvId, MakeError};
use fetch_sim::Task;
use goal_reward::RewardKind;

/// FetchReachDense-v4, the chapter's environment.
pub const DENSE_REACH: EnvId = EnvId { task: Task::Reach, reward: RewardKind::Dense };

/// Where a command of the chapter's pipeline begins.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct StartArgs {
    /// Environment, or auto for FetchReachDense-v4
    #[arg(long, value_name = "ID", default_value = "auto", value_parser = parse_env_id)]
    pub(crate) env_id: EnvId,
    /// Seed of resets, actions and goals
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
}

/// Parses an environment id, or `auto`: FetchReachDense-v4, as in the chapter.
///
/// # Errors
/// There is no such environment.
pub fn parse_env_id(text: &str) -> Result<EnvId, MakeError> {
    if text == "auto" { Ok(DENSE_REACH) } else { text.parse() }
}
