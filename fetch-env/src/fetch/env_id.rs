//! The names of the eight environments.

use std::{fmt, str::FromStr};

use fetch_sim::Task;
use goal_reward::RewardKind;
use serde::{Deserialize, Serialize};

use super::error::MakeError;
use crate::gym::registry::sort_by_similarity;

/// The name of one of the eight environments, such as `FetchPush-v4` or `FetchPushDense-v4`.
///
/// Displayed, parsed and serialized with Gymnasium's spelling.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct EnvId {
    /// The task.
    pub task: Task,
    /// The kind of reward.
    pub reward: RewardKind,
}

impl EnvId {
    /// All environments, task by task, the sparse reward first.
    pub const ALL: [Self; 8] = {
        const KINDS: [RewardKind; 2] = [RewardKind::Sparse, RewardKind::Dense];
        let mut all = [Self { task: Task::Reach, reward: RewardKind::Sparse }; 8];
        let mut i = 0;
        while i < all.len() {
            all[i] = Self { task: Task::ALL[i / 2], reward: KINDS[i % 2] };
            i += 1;
        }
        all
    };
}

impl fmt::Display for EnvId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let suffix = match self.reward {
            RewardKind::Sparse => "",
            RewardKind::Dense => "Dense",
        };
        // `pad` lets tables align the name.
        f.pad(&format!("Fetch{}{suffix}-v4", self.task))
    }
}

impl FromStr for EnvId {
    type Err = MakeError;

    fn from_str(id: &str) -> Result<Self, MakeError> {
        Self::ALL
            .into_iter()
            .find(|known| known.to_string() == id)
            .ok_or_else(|| MakeError::UnknownId { id: id.into(), nearest: nearest(id) })
    }
}

impl TryFrom<String> for EnvId {
    type Error = MakeError;

    fn try_from(id: String) -> Result<Self, MakeError> {
        id.parse()
    }
}

impl From<EnvId> for String {
    fn from(id: EnvId) -> Self {
        id.to_string()
    }
}

/// Returns the most similar names, the nearest first.
fn nearest(id: &str) -> [String; 3] {
    let mut known = EnvId::ALL.map(|known| known.to_string());
    sort_by_similarity(id, &mut known);
    let [first, second, third, ..] = known;
    [first, second, third]
}
