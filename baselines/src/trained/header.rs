//! The header of a trained policy.

use her_relabel::{Normalizer, Scalar, StateRows};
use serde::{Deserialize, Serialize};

use super::error::TrainedPolicyError;
use crate::policy::PolicyError;
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

    /// Checks that an environment has the lengths that the policy was trained with: of observations,
    /// goals and actions.
    pub(super) fn check_lengths(&self, actual: [usize; 3]) -> Result<(), PolicyError> {
        let expected = [self.observation_len, self.goal_len, self.action_len];
        if actual == expected {
            return Ok(());
        }
        Err(PolicyError::Trained { env_id: self.env_id.clone(), expected, actual })
    }

    /// Checks that states are as many rows as the actions, and that their numbers are finite.
    /// Returns the number of rows.
    pub(super) fn check_rows<S: Scalar>(
        &self,
        states: &StateRows<'_, S, f64>,
        actions_len: usize,
    ) -> Result<usize, TrainedPolicyError> {
        let Self { observation_len, goal_len, action_len, .. } = *self;
        let StateRows { observation, achieved_goal, desired_goal } = *states;
        let rows = actions_len / action_len;
        for (what, actual, len) in [
            ("actions", actions_len, action_len),
            ("observations", observation.len(), observation_len),
            ("achieved goals", achieved_goal.len(), goal_len),
            ("desired goals", desired_goal.len(), goal_len),
        ] {
            if rows.checked_mul(len) != Some(actual) {
                return Err(TrainedPolicyError::Rows { what, actual, rows, len });
            }
        }
        check_finite("observation", observation, observation_len)?;
        check_finite("achieved_goal", achieved_goal, goal_len)?;
        check_finite("desired_goal", desired_goal, goal_len)?;
        Ok(rows)
    }

    /// Returns one of the rows of states whose lengths were checked.
    pub(super) fn row<'a, S>(
        &self,
        states: &StateRows<'a, S, f64>,
        row: usize,
    ) -> StateRows<'a, S, f64> {
        let Self { observation_len, goal_len, .. } = *self;
        StateRows {
            observation: &states.observation[row * observation_len..][..observation_len],
            achieved_goal: &states.achieved_goal[row * goal_len..][..goal_len],
            desired_goal: &states.desired_goal[row * goal_len..][..goal_len],
        }
    }

    /// Appends the network's input for a state whose lengths and numbers were checked. `way` is
    /// memory.
    pub(super) fn push_inputs<S: Scalar>(
        &self,
        observation: &[S],
        achieved_goal: &[f64],
        desired_goal: &[f64],
        way: &mut Vec<f64>,
        inputs: &mut Vec<f32>,
    ) {
        let goal_scale = self.goal_normalizer.as_ref();
        for part in &self.inputs {
            match part {
                InputPart::Observation => {
                    push_normalized(self.observation_normalizer.as_ref(), observation, inputs);
                }
                InputPart::AchievedGoal => push_normalized(goal_scale, achieved_goal, inputs),
                InputPart::DesiredGoal => push_normalized(goal_scale, desired_goal, inputs),
                InputPart::RelativeGoal => {
                    let pairs = desired_goal.iter().zip(achieved_goal);
                    way.clear();
                    way.extend(pairs.map(|(desired, achieved)| desired - achieved));
                    push_normalized(goal_scale, way, inputs);
                }
            }
        }
    }
}

/// Checks that each number of rows of `len` is finite in `f32`, in which networks compute.
fn check_finite<S: Scalar>(
    part: &'static str,
    numbers: &[S],
    len: usize,
) -> Result<(), TrainedPolicyError> {
    let is_bad = |number: &S| !(number.to_f64() as f32).is_finite();
    match numbers.iter().position(is_bad) {
        None => Ok(()),
        Some(at) => {
            let (row, index, value) = (at / len, at % len, numbers[at].to_f64());
            Err(TrainedPolicyError::StateNotFinite { part, row, index, value })
        }
    }
}

/// Appends numbers to an input, normalized if the policy has a normalizer for them.
fn push_normalized<S: Scalar>(scale: Option<&Normalizer>, numbers: &[S], input: &mut Vec<f32>) {
    let start = input.len();
    input.extend(numbers.iter().map(|number| number.to_f64() as f32));
    if let Some(scale) = scale {
        // Lengths and numbers were checked.
        let _ = scale.normalize_into(numbers, &mut input[start..]);
    }
}
