//! The names of environments, and the errors of names that do not exist.

use std::{fmt, str::FromStr};

use fetch_sim::Task;
use goal_reward::RewardKind;
use serde::{Deserialize, Serialize};

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
    type Err = UnknownEnvId;

    fn from_str(id: &str) -> Result<Self, UnknownEnvId> {
        Self::ALL
            .into_iter()
            .find(|known| known.to_string() == id)
            .ok_or_else(|| UnknownEnvId { id: id.into(), nearest: nearest(id) })
    }
}

impl TryFrom<String> for EnvId {
    type Error = UnknownEnvId;

    fn try_from(id: String) -> Result<Self, UnknownEnvId> {
        id.parse()
    }
}

impl From<EnvId> for String {
    fn from(id: EnvId) -> Self {
        id.to_string()
    }
}

/// Error returned when no environment has the given name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no environment {id:?}: the nearest are {}, {} and {}", nearest[0], nearest[1], nearest[2])]
#[non_exhaustive]
pub struct UnknownEnvId {
    /// The name.
    pub id: String,
    /// The environments with the most similar names, the nearest first.
    pub nearest: [EnvId; 3],
}

/// Error returned when a [`Registry`](crate::Registry) cannot add or find an environment.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RegistryError {
    /// The name does not follow the rules.
    #[error("{id:?} is no name of an environment: pass one such as Name-v1 or namespace/Name-v1")]
    Malformed {
        /// The name.
        id: String,
    },
    /// The name is in use.
    #[error("there is an environment {id:?} already: give the new one another name or version")]
    Taken {
        /// The name.
        id: String,
    },
    /// No environment has this name.
    #[error("there is no environment {id:?}: {}", advice(nearest))]
    Unknown {
        /// The name.
        id: String,
        /// Up to three environments with the most similar names, the nearest first.
        nearest: Vec<String>,
    },
}

fn advice(nearest: &[String]) -> String {
    match nearest {
        [] => "register one first".into(),
        names => format!("the nearest are {}", names.join(", ")),
    }
}

/// Returns the environments with the most similar names, the nearest first.
fn nearest(id: &str) -> [EnvId; 3] {
    let mut known = EnvId::ALL;
    sort_by_similarity(id, &mut known);
    [known[0], known[1], known[2]]
}

/// Sorts names by their similarity to `id`, ignoring case, the nearest first.
pub(crate) fn sort_by_similarity(id: &str, known: &mut [impl ToString]) {
    let lowercase = id.to_lowercase();
    known.sort_by_cached_key(|known| {
        strsim::damerau_levenshtein(&lowercase, &known.to_string().to_lowercase())
    });
}
