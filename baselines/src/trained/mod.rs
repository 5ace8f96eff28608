//! Trained policies: small networks that are loaded from a file.

mod any;
pub(crate) mod error;
pub(crate) mod file;
mod header;
#[cfg(feature = "learn")]
mod layers;
#[cfg(all(feature = "learn", feature = "render"))]
mod pixel_file;
#[cfg(all(feature = "learn", feature = "render"))]
mod pixels;
mod shipped;
#[cfg(all(feature = "learn", feature = "render"))]
mod sight;

use std::mem;
use std::path::Path;

use fetch_env::{GoalObservation, Space, vec_env::VecStep};
use her_relabel::{Scalar, StateRows};

pub use any::AnyPolicy;
pub use error::TrainedPolicyError;
pub use header::{InputPart, PolicyHeader, SuccessRate};
#[cfg(all(feature = "learn", feature = "render"))]
pub use pixels::PixelPolicy;
#[cfg(all(feature = "learn", feature = "render"))]
pub use sight::{SeenField, Sight};

use crate::dims::lengths_of;
use crate::policy::{Policy, PolicyError, VecPolicy};
use crate::tanh::tanh;

/// A trained policy: a network with rectified linear units and a hyperbolic tangent at its end, the
/// normalizers of its inputs, and how it was trained.
///
/// The file is a [safetensors](https://docs.rs/safetensors) file of the tensors `layers.0.weight`,
/// `layers.0.bias`, and so on, where a weight has a row for each input; its metadata has the
/// [header](PolicyHeader) as JSON under the key `policy`.
///
/// An output of a layer is its bias, to which the products of inputs and weights are added one
/// after the other, in the order of the inputs and in `f32`, and the hyperbolic tangent is rounded
/// once, from `f64`. Any code that adds and rounds like this gets the same bits.
#[derive(Clone, Debug)]
pub struct TrainedPolicy {
    header: PolicyHeader,
    layers: Vec<LayerWeights>,
    work: Work,
}

/// The vectors that an action is computed with; they are reused.
#[derive(Clone, Debug, Default)]
struct Work {
    /// The way to the goal.
    way: Vec<f64>,
    /// The inputs of a layer.
    inputs: Vec<f32>,
    /// Its outputs.
    outputs: Vec<f32>,
}

/// A layer of a network: `outputs = inputs * weights + biases`.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerWeights {
    /// The number of inputs.
    pub num_inputs: usize,
    /// A row for each input.
    pub weights: Vec<f32>,
    /// One for each output.
    pub biases: Vec<f32>,
}

impl PartialEq for TrainedPolicy {
    fn eq(&self, other: &Self) -> bool {
        self.header == other.header && self.layers == other.layers
    }
}

impl TrainedPolicy {
    /// Creates a policy from the layers of its network.
    ///
    /// # Errors
    /// [`TrainedPolicyError`] if the header contradicts itself, or the layers do not fit it or have
    /// a number that is not finite.
    pub fn new(header: PolicyHeader, layers: &[LayerWeights]) -> Result<Self, TrainedPolicyError> {
        header.check()?;
        let mut len = header.input_len();
        for (number, layer) in layers.iter().enumerate() {
            layer.check(number, len)?;
            len = layer.biases.len();
        }
        if layers.is_empty() || len != header.action_len {
            return Err(TrainedPolicyError::Tensor {
                tensor: file::name(layers.len().saturating_sub(1), "bias"),
                actual: format!("of {len} numbers"),
                expected: format!("{}, the length of an action", header.action_len),
            });
        }
        Ok(Self { header, layers: layers.to_vec(), work: Work::default() })
    }

    /// Loads a policy from a file.
    ///
    /// # Errors
    /// [`TrainedPolicyError`] if the file cannot be read, is damaged, or is not a policy.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, TrainedPolicyError> {
        file::load(path.as_ref(), Self::from_bytes)
    }

    /// Creates a policy from the contents of a file.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TrainedPolicyError> {
        file::decode(bytes)
    }

    /// Returns the contents of a file with this policy.
    ///
    /// # Errors
    /// [`TrainedPolicyError`] if the file could not be loaded: its success rate is not a number,
    /// its settings are nested more than about 120 deep, or it takes more than 64 MiB.
    pub fn to_bytes(&self) -> Result<Vec<u8>, TrainedPolicyError> {
        file::encode(self)
    }

    /// Saves the policy to a file, which appears whole or not at all: a previous file stays as it
    /// was if anything fails. A symbolic link is followed.
    ///
    /// # Errors
    /// [`TrainedPolicyError::Write`], and those of [`to_bytes`](Self::to_bytes).
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), TrainedPolicyError> {
        file::save(path.as_ref(), &self.to_bytes()?)
    }

    /// Returns how the policy was trained, and for what.
    #[must_use]
    pub const fn header(&self) -> &PolicyHeader {
        &self.header
    }

    /// Returns the layers of the network, from the first to the last.
    #[must_use]
    pub fn layers(&self) -> &[LayerWeights] {
        &self.layers
    }

    /// Sets the success rate that an evaluation has measured.
    #[must_use]
    pub fn with_success(mut self, success: SuccessRate) -> Self {
        self.header.success = Some(success);
        self
    }

    /// Checks that observations and actions of an environment have the lengths that the policy was
    /// trained with.
    ///
    /// # Errors
    /// [`PolicyError::Trained`].
    pub fn check_lengths(
        &self,
        observation: usize,
        goal: usize,
        action: usize,
    ) -> Result<(), PolicyError> {
        self.header.check_lengths([observation, goal, action])
    }

    /// Writes the greedy actions for states, row after row: `action_len` numbers for each.
    ///
    /// ```
    /// use baselines::TrainedPolicy;
    /// use fetch_env::{Task, make_kinematic_vec, vec_env::VecConfig};
    ///
    /// let mut policy = TrainedPolicy::shipped(Task::Push)?;
    /// let mut envs = make_kinematic_vec("FetchPush-v4", 3, VecConfig::default())?;
    /// let mut actions = [0.0; 3 * 4];
    /// policy.act_rows(&envs.reset(Some(0))?.into(), &mut actions)?;
    /// assert!(actions.iter().all(|action| action.abs() <= 1.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`TrainedPolicyError::Rows`] if the lengths are not those of the same number of rows, and
    /// [`TrainedPolicyError::StateNotFinite`]; nothing is written then.
    pub fn act_rows<S: Scalar>(
        &mut self,
        states: &StateRows<'_, S, f64>,
        actions: &mut [f32],
    ) -> Result<(), TrainedPolicyError> {
        let PolicyHeader { observation_len, goal_len, action_len, .. } = self.header;
        let StateRows { observation, achieved_goal, desired_goal } = *states;
        self.header.check_rows(states, actions.len())?;
        let goals = achieved_goal.chunks_exact(goal_len).zip(desired_goal.chunks_exact(goal_len));
        let states = observation.chunks_exact(observation_len).zip(goals);
        for ((observation, (achieved, desired)), action) in
            states.zip(actions.chunks_exact_mut(action_len))
        {
            self.write_action(observation, achieved, desired, action);
        }
        Ok(())
    }

    fn check_fit(&self, observation: &Space, action: &Space) -> Result<(), PolicyError> {
        let [observation, goal, action] = lengths_of(observation, action)?;
        self.check_lengths(observation, goal, action)
    }

    /// Writes the greedy action for one observation and its goals, or NaN if [`act_rows`] refuses
    /// them.
    ///
    /// [`act_rows`]: Self::act_rows
    fn act_on<S: Scalar>(
        &mut self,
        observation: &[S],
        achieved_goal: &[f64],
        desired_goal: &[f64],
        action: &mut [f32],
    ) {
        let states = StateRows { observation, achieved_goal, desired_goal };
        if self.act_rows(&states, action).is_err() {
            action.fill(f32::NAN);
        }
    }

    /// Writes the greedy action for one observation and its goals, whose lengths and numbers were
    /// checked.
    fn write_action<S: Scalar>(
        &mut self,
        observation: &[S],
        achieved_goal: &[f64],
        desired_goal: &[f64],
        action: &mut [f32],
    ) {
        let Self { header, layers, work: Work { way, inputs, outputs } } = self;
        inputs.clear();
        header.push_inputs(observation, achieved_goal, desired_goal, way, inputs);
        let last = layers.len() - 1;
        for (number, layer) in layers.iter().enumerate() {
            layer.write_outputs(inputs, outputs);
            if number < last {
                outputs.iter_mut().for_each(|value| *value = value.max(0.0));
            }
            mem::swap(inputs, outputs);
        }
        for (action, value) in action.iter_mut().zip(inputs) {
            *action = tanh(*value);
        }
    }
}

impl LayerWeights {
    /// Checks layer `number`, which gets `num_inputs` inputs.
    fn check(&self, number: usize, num_inputs: usize) -> Result<(), TrainedPolicyError> {
        let (weight, bias) = (file::name(number, "weight"), file::name(number, "bias"));
        let num_outputs = self.biases.len();
        if self.num_inputs != num_inputs
            || num_outputs == 0
            || num_inputs.checked_mul(num_outputs) != Some(self.weights.len())
        {
            return Err(TrainedPolicyError::Tensor {
                tensor: weight,
                actual: format!("of {} inputs and {} numbers", self.num_inputs, self.weights.len()),
                expected: format!("of {num_inputs} inputs and {num_outputs} outputs"),
            });
        }
        for (tensor, numbers) in [(weight, &self.weights), (bias, &self.biases)] {
            if let Some(index) = numbers.iter().position(|number| !number.is_finite()) {
                return Err(TrainedPolicyError::NotFinite { tensor, index, value: numbers[index] });
            }
        }
        Ok(())
    }

    /// Writes the outputs of the layer for inputs.
    fn write_outputs(&self, inputs: &[f32], outputs: &mut Vec<f32>) {
        outputs.clear();
        outputs.extend_from_slice(&self.biases);
        for (input, weights) in inputs.iter().zip(self.weights.chunks_exact(self.biases.len())) {
            for (output, weight) in outputs.iter_mut().zip(weights) {
                *output += weight * input;
            }
        }
    }
}

impl<O: GoalObservation<Element: Scalar>> Policy<O> for TrainedPolicy {
    fn check_spaces(
        &self,
        observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        self.check_fit(observation_space, action_space)
    }

    fn act(&mut self, observation: &O, action: &mut [f32]) {
        self.act_on(
            observation.observation(),
            observation.achieved_goal(),
            observation.desired_goal(),
            action,
        );
    }
}

/// Chooses the same actions as for one environment at a time.
impl<O: GoalObservation<Element: Scalar>, I> VecPolicy<O, I> for TrainedPolicy {
    fn check_spaces(
        &self,
        observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        self.check_fit(observation_space, action_space)
    }

    fn act_all(&mut self, batch: &VecStep<O, I>, actions: &mut [f32]) {
        let states = StateRows::from(batch);
        match self.act_rows(&states, actions) {
            Ok(()) => {}
            // The other rows still act.
            Err(TrainedPolicyError::StateNotFinite { .. }) => {
                for (row, action) in actions.chunks_exact_mut(self.header.action_len).enumerate() {
                    let StateRows { observation, achieved_goal, desired_goal } =
                        self.header.row(&states, row);
                    self.act_on(observation, achieved_goal, desired_goal, action);
                }
            }
            Err(_) => actions.fill(f32::NAN),
        }
    }
}
