//! The inputs of a network: observations and goals on one scale.

use her_relabel::{Dims, Normalizer, NormalizerConfig, NormalizerError, Scalar};
use serde::{Deserialize, Serialize};

use super::settings::InputSettings;
use crate::trained::InputPart;

/// How observations and goals become the inputs of a network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Inputs {
    pub(crate) observation: Normalizer,
    /// Of relative goals, if inputs have them.
    pub(crate) goal: Normalizer,
    relative_goal: bool,
}

/// Observations and goals, a row for each input.
#[derive(Clone, Copy)]
pub(crate) struct Seen<'a, S, G> {
    pub(crate) observations: &'a [S],
    pub(crate) achieved_goals: &'a [G],
    pub(crate) desired_goals: &'a [G],
}

impl Inputs {
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
    pub(crate) fn len(&self) -> usize {
        self.observation.dim() + self.goal.dim()
    }

    /// The parts of an input.
    pub(crate) fn parts(&self) -> Vec<InputPart> {
        let goal =
            if self.relative_goal { InputPart::RelativeGoal } else { InputPart::DesiredGoal };
        vec![InputPart::Observation, goal]
    }

    /// Takes observations and goals into the scale.
    pub(crate) fn update<S: Scalar, G: Scalar>(
        &mut self,
        seen: Seen<'_, S, G>,
    ) -> Result<(), NormalizerError> {
        self.observation.update(seen.observations)?;
        let goals: Vec<f64> = self.goals(seen).collect();
        self.goal.update(&goals)
    }

    /// Writes inputs: each observation with its goal behind it, normalized. A row with a number that
    /// is not finite becomes 0. Returns whether there was none.
    pub(crate) fn write<S: Scalar, G: Scalar>(
        &self,
        seen: Seen<'_, S, G>,
        inputs: &mut Vec<f32>,
    ) -> bool {
        let (len, goal_len) = (self.observation.dim(), self.goal.dim());
        let goals: Vec<f64> = self.goals(seen).collect();
        inputs.resize(seen.observations.len() / len * self.len(), 0.0);
        let mut all_finite = true;
        let rows = seen.observations.chunks_exact(len).zip(goals.chunks_exact(goal_len));
        for (input, (observation, goal)) in inputs.chunks_exact_mut(self.len()).zip(rows) {
            let (first, second) = input.split_at_mut(len);
            let normalized = self
                .observation
                .normalize_into(observation, first)
                .and_then(|()| self.goal.normalize_into(goal, second));
            if normalized.is_err() {
                input.fill(0.0);
                all_finite = false;
            }
        }
        all_finite
    }

    /// Returns the numbers of all goals, as the network sees them before their normalization.
    fn goals<S, G: Scalar>(&self, seen: Seen<'_, S, G>) -> impl Iterator<Item = f64> {
        let relative = self.relative_goal;
        let pairs = seen.achieved_goals.iter().zip(seen.desired_goals);
        pairs.map(move |(achieved, desired)| {
            desired.to_f64() - if relative { achieved.to_f64() } else { 0.0 }
        })
    }
}
