//! What a learning algorithm is, and what the two have in common.

use std::fmt::Debug;

use serde::{Deserialize, Serialize};

use super::actor::Actor;
use super::adam::Adam;
use super::error::TrainError;
use super::network::Network;
use super::range::check_range;
use crate::trained::LayerWeights;
use crate::workers::Workers;

/// A learning algorithm: it improves an actor by batches of transitions. Only
/// [`Ddpg`](super::Ddpg) and [`Sac`](super::Sac) implement it.
pub trait Algorithm: Debug + Send + sealed::Sealed {
    /// Improves the actor by one batch. Two threads of the current rayon pool share the work; the
    /// result does not depend on their number. Each process has a batch of its own, and all take the
    /// same step: against the mean of their gradients.
    ///
    /// # Panics
    /// If the batch has no transitions, or columns of other lengths than the networks' and its own.
    fn update(&mut self, batch: Transitions<'_>, workers: &mut dyn Workers) -> Losses;

    /// Returns the actor that explores.
    fn actor(&self) -> Actor;

    /// Returns the layers of the actor that is evaluated, which is greedy: their outputs, through a
    /// hyperbolic tangent, are its actions.
    fn greedy_layers(&self) -> Vec<LayerWeights>;

    /// Returns everything that the following updates depend on, to be saved or replaced.
    fn state_mut(&mut self) -> StateMut<'_>;
}

mod sealed {
    /// Keeps others from implementing [`Algorithm`](super::Algorithm).
    pub trait Sealed {}

    impl Sealed for super::super::Ddpg {}
    impl Sealed for super::super::Sac {}
}

/// The losses of an update, means over its batch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Losses {
    /// The squared error of the critic, for several critics their sum.
    pub critic: f32,
    /// The loss of the actor.
    pub actor: f32,
    /// The value of the batch's own actions.
    pub value: f32,
}

impl Losses {
    /// Whether all are finite.
    #[must_use]
    pub fn are_finite(&self) -> bool {
        [self.critic, self.actor, self.value].iter().all(|loss| loss.is_finite())
    }
}

/// A batch of transitions as an algorithm sees it: columns with a row for each transition.
#[derive(Clone, Copy, Debug)]
pub struct Transitions<'a> {
    /// The number of transitions, at least 1.
    pub len: usize,
    /// The inputs of the networks before the step, `(len, num_inputs)`: normalized observations and
    /// goals.
    pub inputs: &'a [f32],
    /// The actions, `(len, num_actions)`, from -1 to 1.
    pub actions: &'a [f32],
    /// The rewards, `(len)`.
    pub rewards: &'a [f32],
    /// The discounts of the next states' values, `(len)`: 0 where the task ended.
    pub discounts: &'a [f32],
    /// The inputs of the networks after the step, `(len, num_inputs)`.
    pub next_inputs: &'a [f32],
}

impl Transitions<'_> {
    /// The number of elements of an action.
    pub(crate) const fn num_actions(&self) -> usize {
        self.actions.len() / self.len
    }

    /// The weight of a transition in a mean over the batch.
    pub(crate) const fn share(&self) -> f32 {
        1.0 / self.len as f32
    }
}

/// Checks the lengths of the networks' inputs and of actions.
pub(crate) fn check_lengths(num_inputs: usize, num_actions: usize) -> Result<(), TrainError> {
    check_range!(num_inputs, "num_inputs", 1..=16_384)?;
    check_range!(num_actions, "num_actions", 1..=1_024)
}

/// A network with its optimizer.
pub(crate) struct Trained {
    pub(crate) network: Network,
    pub(crate) adam: Adam,
}

impl Trained {
    pub(crate) fn new(network: Network, learning_rate: f32) -> Self {
        let adam = Adam::new(learning_rate, network.parameters.len());
        Self { network, adam }
    }

    /// Takes step `number`, counted from 1, against a gradient.
    pub(crate) fn step(&mut self, number: u64, gradient: &[f32]) {
        self.adam.step(number, &mut self.network.parameters, gradient);
    }
}

/// The state of an [`Algorithm`]: everything that its following updates depend on.
#[derive(Debug)]
pub struct StateMut<'a> {
    /// The number of updates so far.
    pub num_updates: &'a mut u64,
    /// Parameters and moments, each with its name. Their lengths never change.
    pub vectors: Vec<(String, &'a mut Vec<f32>)>,
}

impl<'a> StateMut<'a> {
    pub(crate) fn new(num_updates: &'a mut u64) -> Self {
        Self { num_updates, vectors: Vec::new() }
    }

    pub(crate) fn push(&mut self, name: &str, part: &str, vector: &'a mut Vec<f32>) {
        self.vectors.push((format!("{name}.{part}"), vector));
    }

    pub(crate) fn push_target(&mut self, name: &str, network: &'a mut Network) {
        self.push(name, "parameters", &mut network.parameters);
    }

    pub(crate) fn push_adam(&mut self, name: &str, adam: &'a mut Adam) {
        self.push(name, "first_moment", &mut adam.first_moment);
        self.push(name, "second_moment", &mut adam.second_moment);
    }

    pub(crate) fn push_trained(&mut self, name: &str, trained: &'a mut Trained) {
        self.push_target(name, &mut trained.network);
        self.push_adam(name, &mut trained.adam);
    }
}
