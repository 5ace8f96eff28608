//! The inputs of a network: observations and goals on one scale.

use her_relabel::{
    Batch, Dims, JoinedGoal, Normalizer, NormalizerConfig, NormalizerError, Normalizers, Scalar,
};
use serde::{Deserialize, Serialize};

use super::settings::InputSettings;
use crate::trained::InputPart;

/// How observations and goals become the inputs of a network: joined, on one scale, which grows with
/// what is collected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inputs {
    pub(crate) observation: Normalizer,
    /// Of relative goals, if inputs have them.
    pub(crate) goal: Normalizer,
    relative_goal: bool,
}

/// Observations and goals, a row for each input.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a, S, G> {
    /// The observations, `(len, dims.observation)`.
    pub observations: &'a [S],
    /// The achieved goals, `(len, dims.goal)`.
    pub achieved_goals: &'a [G],
    /// The desired goals, `(len, dims.goal)`.
    pub desired_goals: &'a [G],
}

impl<'a, T: Scalar> Seen<'a, T, T> {
    /// What networks see before the steps of a batch.
    #[must_use]
    pub fn before(batch: &'a Batch<T>) -> Self {
        Self {
            observations: batch.observation(),
            achieved_goals: batch.achieved_goal(),
            desired_goals: batch.desired_goal(),
        }
    }
}

impl Inputs {
    /// Makes inputs of observations and goals of some lengths, not yet scaled.
    ///
    /// # Errors
    /// [`NormalizerError`] if a setting or a length cannot be.
    pub fn new(settings: &InputSettings, dims: Dims) -> Result<Self, NormalizerError> {
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
    #[must_use]
    pub fn dim(&self) -> usize {
        self.observation.dim() + self.goal.dim()
    }

    /// Whether they are those of the settings.
    pub(crate) const fn have(&self, settings: &InputSettings) -> bool {
        self.relative_goal == settings.relative_goal
    }

    /// Returns the goal that inputs have behind the observation.
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

    /// Takes observations and goals into the scale.
    ///
    /// # Errors
    /// [`NormalizerError`] if a number is not finite, or a length is wrong.
    pub fn update<S: Scalar, G: Scalar>(
        &mut self,
        seen: Seen<'_, S, G>,
    ) -> Result<(), NormalizerError> {
        self.observation.update(seen.observations)?;
        let mut goals = vec![0.0; seen.desired_goals.len()];
        self.put_goal(seen.achieved_goals, seen.desired_goals, &mut goals);
        self.goal.update(&goals)
    }

    /// Takes into the scale what other inputs have seen.
    pub(crate) fn merge(&mut self, other: &Self) -> Result<(), NormalizerError> {
        self.observation.merge(&other.observation)?;
        self.goal.merge(&other.goal)
    }

    /// Writes inputs, a row of [`dim`](Self::dim) numbers for each observation: the observation with its
    /// goal behind it, normalized. Rows with a number that is not finite become 0. Returns the first of them, if there is one.
    pub fn write<S: Scalar, G: Scalar>(
        &self,
        seen: Seen<'_, S, G>,
        inputs: &mut Vec<f32>,
    ) -> Option<usize> {
        let (len, goal_len) = (self.observation.dim(), self.goal.dim());
        let mut goal = vec![0.0; goal_len];
        inputs.resize(seen.observations.len() / len * self.dim(), 0.0);
        let mut first_bad = None;
        let goals = seen
            .achieved_goals
            .chunks_exact(goal_len)
            .zip(seen.desired_goals.chunks_exact(goal_len));
        let rows = seen.observations.chunks_exact(len).zip(goals);
        for (row, (input, (observation, (achieved, desired)))) in
            inputs.chunks_exact_mut(self.dim()).zip(rows).enumerate()
        {
            let (first, second) = input.split_at_mut(len);
            let normalized = self
                .observation
                .normalize_into(observation, first)
                .and_then(|()| self.write_goal(achieved, desired, &mut goal, second));
            if normalized.is_err() {
                input.fill(0.0);
                first_bad.get_or_insert(row);
            }
        }
        first_bad
    }

    /// Writes a goal by way of `goal`, its memory before the normalization.
    fn write_goal<G: Scalar>(
        &self,
        achieved: &[G],
        desired: &[G],
        goal: &mut [f64],
        target: &mut [f32],
    ) -> Result<(), NormalizerError> {
        self.put_goal(achieved, desired, goal);
        self.goal.normalize_into(goal, target)
    }

    /// Writes goals as the network sees them, before their normalization.
    fn put_goal<G: Scalar>(&self, achieved: &[G], desired: &[G], goal: &mut [f64]) {
        for ((goal, achieved), desired) in goal.iter_mut().zip(achieved).zip(desired) {
            *goal = desired.to_f64() - if self.relative_goal { achieved.to_f64() } else { 0.0 };
        }
    }
}
