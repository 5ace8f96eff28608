//! The inputs of a network: normalized observations and goals.

use her_relabel::{
    Batch, Dims, JoinedGoal, Normalizer, NormalizerConfig, NormalizerError, Normalizers, Scalar,
};
use serde::{Deserialize, Serialize};

use super::settings::InputSettings;
use crate::trained::{InputPart, push_normalized};

/// How observations and goals become the inputs of a network: joined, and normalized by the
/// statistics of what was collected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Inputs {
    pub(crate) observation: Normalizer,
    /// Of relative goals, if inputs have them.
    pub(crate) goal: Normalizer,
    relative_goal: bool,
}

/// Observations and goals, a row for each input.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<'a, T> {
    /// The observations, `(len, dims.observation)`.
    pub(crate) observations: &'a [T],
    /// The achieved goals, `(len, dims.goal)`.
    pub(crate) achieved_goals: &'a [T],
    /// The desired goals, `(len, dims.goal)`.
    pub(crate) desired_goals: &'a [T],
}

impl<'a, T: Scalar> Seen<'a, T> {
    /// Returns what networks see before the steps of a batch.
    pub(crate) fn before(batch: &'a Batch<T>) -> Self {
        Self {
            observations: batch.observation(),
            achieved_goals: batch.achieved_goal(),
            desired_goals: batch.desired_goal(),
        }
    }
}

impl Inputs {
    /// Creates inputs for observations and goals of these lengths, without statistics yet.
    pub(crate) fn new(settings: &InputSettings, dims: Dims) -> Result<Self, NormalizerError> {
        let InputSettings { relative_goal, min_std, clip } = *settings;
        let normalizer =
            |dim| Normalizer::new(NormalizerConfig::new(dim).with_min_std(min_std).with_clip(clip));
        Ok(Self {
            observation: normalizer(dims.observation)?,
            goal: normalizer(dims.goal)?,
            relative_goal,
        })
    }

    /// Returns the length of an input.
    pub(crate) fn dim(&self) -> usize {
        self.observation.dim() + self.goal.dim()
    }

    /// Whether the inputs have the form that the settings ask for.
    pub(crate) const fn have(&self, settings: &InputSettings) -> bool {
        self.relative_goal == settings.relative_goal
    }

    /// Returns which goal follows the observation in an input.
    pub(crate) const fn joined_goal(&self) -> JoinedGoal {
        if self.relative_goal { JoinedGoal::Relative } else { JoinedGoal::Desired }
    }

    /// Returns the normalizers of a draw.
    pub(crate) const fn normalizers(&self) -> Normalizers<'_> {
        Normalizers { observation: Some(&self.observation), goal: Some(&self.goal) }
    }

    /// Returns the parts of an input.
    pub(crate) fn parts(&self) -> Vec<InputPart> {
        let goal =
            if self.relative_goal { InputPart::RelativeGoal } else { InputPart::DesiredGoal };
        vec![InputPart::Observation, goal]
    }

    /// Updates the normalizers with observations and goals.
    pub(crate) fn update<T: Scalar>(&mut self, seen: Seen<'_, T>) -> Result<(), NormalizerError> {
        self.observation.update(seen.observations)?;
        let mut goals = vec![0.0; seen.desired_goals.len()];
        self.put_goals(seen, &mut goals);
        self.goal.update(&goals)
    }

    /// Updates the normalizers with what another process collected.
    pub(crate) fn merge(&mut self, other: &Self) -> Result<(), NormalizerError> {
        self.observation.merge(&other.observation)?;
        self.goal.merge(&other.goal)
    }

    /// Writes inputs, a row for each observation: the observation and then its goal, normalized.
    pub(crate) fn write<T: Scalar>(&self, seen: Seen<'_, T>, inputs: &mut Vec<f32>) {
        let (len, goal_len) = (self.observation.dim(), self.goal.dim());
        let mut goals = vec![0.0; seen.desired_goals.len()];
        self.put_goals(seen, &mut goals);
        let observations = seen.observations.chunks_exact(len);
        inputs.clear();
        for (observation, goal) in observations.zip(goals.chunks_exact(goal_len)) {
            push_normalized((Some(&self.observation), len), observation, inputs);
            push_normalized((Some(&self.goal), goal_len), goal, inputs);
        }
    }

    /// Writes goals as the network sees them, before their normalization.
    fn put_goals<T: Scalar>(&self, seen: Seen<'_, T>, goals: &mut [f64]) {
        let pairs = seen.achieved_goals.iter().zip(seen.desired_goals);
        for (goal, (achieved, desired)) in goals.iter_mut().zip(pairs) {
            *goal = desired.to_f64() - if self.relative_goal { achieved.to_f64() } else { 0.0 };
        }
    }
}
