//! The inputs of a network: normalized observations and goals.

use her_relabel::{
    Batch, Dims, JoinedGoal, Normalizer, NormalizerConfig, NormalizerError, Normalizers, Scalar,
};
use serde::{Deserialize, Serialize};

use super::settings::InputSettings;
use crate::trained::InputPart;

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
pub(crate) struct Seen<'a, S, G> {
    /// The observations, `(len, dims.observation)`.
    pub(crate) observations: &'a [S],
    /// The achieved goals, `(len, dims.goal)`.
    pub(crate) achieved_goals: &'a [G],
    /// The desired goals, `(len, dims.goal)`.
    pub(crate) desired_goals: &'a [G],
}

impl<'a, T: Scalar> Seen<'a, T, T> {
    /// What networks see before the steps of a batch.
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

    /// The length of an input.
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

    /// The parts of an input.
    pub(crate) fn parts(&self) -> Vec<InputPart> {
        let goal =
            if self.relative_goal { InputPart::RelativeGoal } else { InputPart::DesiredGoal };
        vec![InputPart::Observation, goal]
    }

    /// Updates the normalizers with observations and goals.
    pub(crate) fn update<S: Scalar, G: Scalar>(
        &mut self,
        seen: Seen<'_, S, G>,
    ) -> Result<(), NormalizerError> {
        self.observation.update(seen.observations)?;
        let mut goals = vec![0.0; seen.desired_goals.len()];
        self.put_goal(seen.achieved_goals, seen.desired_goals, &mut goals);
        self.goal.update(&goals)
    }

    /// Updates the normalizers with what another process collected.
    pub(crate) fn merge(&mut self, other: &Self) -> Result<(), NormalizerError> {
        self.observation.merge(&other.observation)?;
        self.goal.merge(&other.goal)
    }

    /// Writes inputs, a row for each observation: the observation and then its goal, normalized.
    /// Rows with a number that is not finite become 0.
    pub(crate) fn write<S: Scalar, G: Scalar>(&self, seen: Seen<'_, S, G>, inputs: &mut Vec<f32>) {
        let (len, goal_len) = (self.observation.dim(), self.goal.dim());
        let mut goal = vec![0.0; goal_len];
        inputs.resize(seen.observations.len() / len * self.dim(), 0.0);
        for (row, input) in inputs.chunks_exact_mut(self.dim()).enumerate() {
            let goals = row * goal_len..(row + 1) * goal_len;
            let (achieved, desired) =
                (&seen.achieved_goals[goals.clone()], &seen.desired_goals[goals]);
            self.put_goal(achieved, desired, &mut goal);
            let (first, second) = input.split_at_mut(len);
            let normalized = self
                .observation
                .normalize_into(&seen.observations[row * len..][..len], first)
                .and_then(|()| self.goal.normalize_into(&goal, second));
            if normalized.is_err() {
                input.fill(0.0);
            }
        }
    }

    /// Writes goals as the network sees them, before their normalization.
    fn put_goal<G: Scalar>(&self, achieved: &[G], desired: &[G], goal: &mut [f64]) {
        for ((goal, achieved), desired) in goal.iter_mut().zip(achieved).zip(desired) {
            *goal = desired.to_f64() - if self.relative_goal { achieved.to_f64() } else { 0.0 };
        }
    }
}
