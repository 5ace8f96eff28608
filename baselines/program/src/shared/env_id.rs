//! The flag `--env-id`.

use fetch_env::{EnvId, MakeError};
use fetch_sim::Task;
use goal_reward::RewardKind;

/// FetchReachDense-v4, the chapter's environment.
pub const DENSE_REACH: EnvId = EnvId { task: Task::Reach, reward: RewardKind::Dense };

/// Parses an environment id, or `auto`: FetchReachDense-v4, as in the chapter.
///
/// # Errors
/// There is no such environment.
pub fn parse_env_id(text: &str) -> Result<EnvId, MakeError> {
    if text == "auto" { Ok(DENSE_REACH) } else { text.parse() }
}
