//! The inputs of a network: normalized observations and goals.

use std::collections::BTreeSet;

use her_relabel::{
    Dims, InputError, JoinedGoal, Normalizer, NormalizerConfig, NormalizerError, Normalizers,
    Scalar, StateRows,
};
use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::learn::error::TrainError;
use crate::learn::settings::train::InputSettings;
use crate::normal::standard_normal;
use crate::trained::{InputPart, LayerWeights};

/// How observations and goals become the inputs of a network: joined, and normalized by the
/// statistics of what was collected, or of the policy that the run started from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Inputs {
    pub(crate) observation: Normalizer,
    /// The normalizer of goals, or of relative goals if the inputs have them.
    pub(crate) goal: Normalizer,
    relative_goal: bool,
    /// The standard deviation of the noise that an actor sees, in the units of the observation.
    actor_observation_noise: f64,
    /// The bound of normalized elements.
    clip: f64,
    /// The elements that are always 0.
    left_out: Vec<usize>,
    /// Whether the statistics no longer change.
    fixed: bool,
}

impl Inputs {
    /// Creates inputs for observations and goals of these lengths, without statistics yet.
    pub(crate) fn new(settings: &InputSettings, dims: Dims) -> Result<Self, NormalizerError> {
        let InputSettings { relative_goal, min_std, clip, actor_observation_noise, .. } = *settings;
        let normalizer =
            |dim| Normalizer::new(NormalizerConfig::new(dim).with_min_std(min_std).with_clip(clip));
        Ok(Self {
            observation: normalizer(dims.observation)?,
            goal: normalizer(dims.goal)?,
            relative_goal,
            actor_observation_noise,
            clip,
            left_out: settings.left_out.clone(),
            fixed: false,
        })
    }

    /// Takes the normalizers of a policy, and keeps them: with others it would be another policy.
    pub(crate) fn fix(&mut self, observation: &Normalizer, goal: &Normalizer) {
        self.observation = observation.clone();
        self.goal = goal.clone();
        self.fixed = true;
    }

    /// Whether the statistics no longer change.
    pub(crate) const fn are_fixed(&self) -> bool {
        self.fixed
    }

    /// Returns the length of an input.
    pub(crate) fn dim(&self) -> usize {
        self.observation.dim() + self.goal.dim()
    }

    /// Whether the inputs have the form that the settings ask for.
    pub(crate) fn have(&self, settings: &InputSettings) -> bool {
        self.relative_goal == settings.relative_goal
            && self.actor_observation_noise == settings.actor_observation_noise
            && self.left_out == settings.left_out
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
    pub(crate) fn update<T: Scalar>(
        &mut self,
        states: &StateRows<'_, T>,
    ) -> Result<(), NormalizerError> {
        self.observation.update(states.observation)?;
        if !self.relative_goal {
            return self.goal.update(states.desired_goal);
        }
        let pairs = states.desired_goal.iter().zip(states.achieved_goal);
        let goals: Vec<f64> =
            pairs.map(|(desired, achieved)| desired.to_f64() - achieved.to_f64()).collect();
        self.goal.update(&goals)
    }

    /// Updates the normalizers with what another process collected.
    pub(crate) fn merge(&mut self, other: &Self) -> Result<(), NormalizerError> {
        self.observation.merge(&other.observation)?;
        self.goal.merge(&other.goal)
    }

    /// Replaces `inputs` with those of some states, a row for each: the observation and then its
    /// goal, normalized.
    pub(crate) fn write<T: Scalar>(
        &self,
        states: &StateRows<'_, T, f64>,
        inputs: &mut Vec<f32>,
    ) -> Result<(), InputError> {
        let dims = Dims { observation: self.observation.dim(), goal: self.goal.dim(), action: 0 };
        inputs.resize(states.observation.len() / dims.observation * self.dim(), 0.0);
        self.normalizers().write_input(self.joined_goal(), dims, states, inputs)?;
        self.leave_out(inputs);
        Ok(())
    }

    /// Adds the noise that an actor sees to rows of inputs.
    pub(crate) fn add_noise(&self, inputs: &mut [f32], rng: &mut impl Rng) {
        let clip = self.clip as f32;
        let scales: Vec<f32> =
            self.observation.std().map(|std| (self.actor_observation_noise / std) as f32).collect();
        for row in inputs.chunks_exact_mut(self.dim()) {
            for (element, scale) in row.iter_mut().zip(&scales) {
                *element = (*element + scale * standard_normal(rng)).clamp(-clip, clip);
            }
        }
        self.leave_out(inputs);
    }

    /// Whether an actor sees noise.
    pub(crate) const fn have_noise(&self) -> bool {
        self.actor_observation_noise > 0.0
    }

    /// Sets the elements that networks do not see to 0 in rows of inputs.
    pub(crate) fn leave_out(&self, inputs: &mut [f32]) {
        for row in inputs.chunks_exact_mut(self.dim()) {
            self.left_out.iter().for_each(|element| row[*element] = 0.0);
        }
    }

    /// Sets the weights of the elements that networks do not see to 0 in the first layer of one, so
    /// it computes the same from whole inputs.
    ///
    /// A layer of the wrong size stays as it is: [`TrainedPolicy::new`](crate::TrainedPolicy::new)
    /// refuses it.
    pub(crate) fn leave_out_weights(&self, layer: &mut LayerWeights) {
        let Some(len) = layer.weights.len().checked_div(layer.num_inputs) else { return };
        for element in &self.left_out {
            if let Some(weights) = layer.weights.get_mut(element * len..(element + 1) * len) {
                weights.fill(0.0);
            }
        }
    }
}

/// Checks that there are such elements of an observation, and that none is named twice.
pub(crate) fn check_left_out(left_out: &[usize], dims: Dims) -> Result<(), TrainError> {
    let elements: BTreeSet<_> = left_out.iter().collect();
    if elements.len() == left_out.len()
        && elements.last().is_none_or(|last| **last < dims.observation)
    {
        return Ok(());
    }
    Err(TrainError::Setting {
        name: "left_out",
        value: format!("{left_out:?}"),
        expected: "choose elements of the observation, counted from 0, each once",
    })
}
