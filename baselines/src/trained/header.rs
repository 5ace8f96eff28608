//! The header of a trained policy.

use her_relabel::Normalizer;
use serde::{Deserialize, Serialize};

use super::error::TrainedPolicyError;
use crate::statistics::Estimate;

/// What a trained policy was trained for, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyHeader {
    /// The version of the format: [`VERSION`](Self::VERSION).
    pub version: u32,
    /// The environment, such as `FetchPush-v4`.
    pub env_id: String,
    /// The length of an observation.
    pub observation_len: usize,
    /// The length of a goal.
    pub goal_len: usize,
    /// The length of an action.
    pub action_len: usize,
    /// The parts of the network's input, in their order.
    pub inputs: Vec<InputPart>,
    /// The normalizer of observations; `None` if they are not normalized.
    pub observation_normalizer: Option<Normalizer>,
    /// The normalizer of goals, or of relative goals; `None` if they are not normalized.
    pub goal_normalizer: Option<Normalizer>,
    /// What trained the policy, such as `ddpg`.
    pub algorithm: String,
    /// The settings of the training, as its program writes them.
    pub settings: serde_json::Value,
    /// The seed of the training.
    pub seed: u64,
    /// The number of environment steps of the training.
    pub steps: u64,
    /// The number of demonstrated episodes that the training began with.
    pub demonstrations: u64,
    /// The measured success rate.
    pub success: Option<SuccessRate>,
}

/// A part of a network's input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum InputPart {
    /// The observation.
    Observation,
    /// The achieved goal.
    AchievedGoal,
    /// The desired goal.
    DesiredGoal,
    /// The desired goal minus the achieved goal.
    RelativeGoal,
}

/// A measured success rate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SuccessRate {
    /// The share of episodes that ended in success, with its 95 % interval.
    pub rate: Estimate,
    /// The number of episodes.
    pub episodes: usize,
    /// The seed of the first episode; each further one has the next.
    pub first_seed: u64,
}

impl PolicyHeader {
    /// The version of the format that this crate writes and reads.
    pub const VERSION: u32 = 1;

    /// Checks that the header does not contradict itself.
    pub(crate) fn check(&self) -> Result<(), TrainedPolicyError> {
        if self.version != Self::VERSION {
            let expected = Self::VERSION;
            return Err(TrainedPolicyError::Version { version: self.version, expected });
        }
        let wrong = |reason| Err(TrainedPolicyError::Header { reason });
        if self.observation_len == 0 || self.goal_len == 0 || self.action_len == 0 {
            return wrong("a length is 0".to_owned());
        }
        let scales = [
            (&self.observation_normalizer, self.observation_len),
            (&self.goal_normalizer, self.goal_len),
        ];
        for (scale, len) in scales {
            if let Some(scale) = scale
                && scale.dim() != len
            {
                return wrong(format!("a normalizer has {} numbers instead of {len}", scale.dim()));
            }
        }
        if let Some(SuccessRate { rate: Estimate { value, low, high }, .. }) = self.success
            && (!value.is_finite() || low.is_nan() || high.is_nan())
        {
            return wrong(format!("the success rate is {value}, between {low} and {high}"));
        }
        Ok(())
    }

    /// Returns the length of the network's input.
    pub(crate) fn input_len(&self) -> usize {
        let len = |part: &InputPart| match part {
            InputPart::Observation => self.observation_len,
            InputPart::AchievedGoal | InputPart::DesiredGoal | InputPart::RelativeGoal => {
                self.goal_len
            }
        };
        self.inputs.iter().map(len).fold(0, usize::saturating_add)
    }
}
