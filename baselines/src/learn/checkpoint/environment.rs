//! How a checkpoint recognizes the environment of its run.

use fetch_env::{BoxSpace, SnapshotEnv, Space};
use goal_reward::GoalReward;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::learn::run::env::LearnEnv;

/// What identifies an environment. It has no id, because a user's environment has none.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EnvMark<S> {
    action_space: BoxSpace<f32>,
    observation_space: Space,
    outcomes: Vec<Outcome>,
    /// The snapshot of an environment that has not been reset.
    snapshot: S,
}

/// The outcome of its reward for a pair of goals.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Outcome {
    /// `None` if it is not finite.
    reward: Option<f64>,
    is_success: bool,
    terminated: bool,
    truncated: bool,
}

impl<S: DeserializeOwned> EnvMark<S> {
    /// Reads a mark, or returns how the environment differs.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, String> {
        serde_json::from_slice(bytes)
            .map_err(|error| format!("its state has a different form: {error}"))
    }

    /// Marks an environment whose goals have `goal_len` numbers.
    pub(crate) fn of<E>(env: &E, goal_len: usize) -> Self
    where
        E: LearnEnv + SnapshotEnv<Snapshot = S>,
    {
        Self {
            action_space: env.action_space().clone(),
            observation_space: env.observation_space().clone(),
            outcomes: outcomes(env.goal_reward(), goal_len),
            snapshot: env.snapshot(),
        }
    }

    /// Returns how an environment differs. One that does not differ is left as it was before its
    /// first reset.
    pub(crate) fn check<E>(&self, env: &mut E, goal_len: usize) -> Result<(), String>
    where
        E: LearnEnv + SnapshotEnv<Snapshot = S>,
    {
        if self.action_space != *env.action_space() {
            return Err("its action space is different".to_owned());
        }
        if self.observation_space != *env.observation_space() {
            return Err("its observation space is different".to_owned());
        }
        let same = outcomes(env.goal_reward(), goal_len);
        if !self.outcomes.iter().zip(&same).all(|(theirs, ours)| theirs.is_nearly(ours)) {
            return Err("it has different rewards for the same goals".to_owned());
        }
        env.restore(&self.snapshot).map_err(|error| error.to_string())
    }
}

impl Outcome {
    /// Whether two outcomes are the same up to rounding, which may differ between processors.
    fn is_nearly(&self, other: &Self) -> bool {
        let rewards = match (self.reward, other.reward) {
            (Some(one), Some(other)) => (one - other).abs() <= 1e-6 * (1.0 + one.abs()),
            (one, other) => one == other,
        };
        let flags = |outcome: &Self| [outcome.is_success, outcome.terminated, outcome.truncated];
        rewards && flags(self) == flags(other)
    }
}

/// Returns the outcomes for goals that are from 1 mm to 50 m apart, each along one axis.
fn outcomes(reward: &impl GoalReward, goal_len: usize) -> Vec<Outcome> {
    let achieved = vec![0.0; goal_len];
    let outcome = |k: i32| {
        let mut desired = achieved.clone();
        if let Some(coordinate) = desired.get_mut(k as usize % goal_len.max(1)) {
            *coordinate = 0.001 * 1.25_f64.powi(k);
        }
        Outcome {
            reward: Some(reward.reward(&achieved, &desired)).filter(|reward| reward.is_finite()),
            is_success: reward.is_success(&achieved, &desired),
            terminated: reward.terminated(&achieved, &desired),
            truncated: reward.truncated(&achieved, &desired),
        }
    };
    (0..49).map(outcome).collect()
}
