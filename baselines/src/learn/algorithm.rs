//! What a learning algorithm is, and what the two have in common.

use std::fmt::Debug;

use her_relabel::Batch;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::actor::Actor;
use super::adam::Adam;
use super::network::Network;
use crate::trained::LayerWeights;

/// A learning algorithm: it improves an actor by batches of transitions.
pub trait Algorithm: Debug + Send {
    /// Improves the actor by one batch, which has joined inputs and discounts. The [parts](PARTS) of
    /// the batch are computed on the threads of the current rayon pool; the result does not depend
    /// on their number.
    ///
    /// # Panics
    /// If the batch has no joined inputs or no discounts, has an odd number of rows, or is of an
    /// environment of other lengths.
    fn update(&mut self, batch: &Batch<f32>) -> Losses;

    /// Returns the actor that explores.
    fn actor(&self) -> Actor;

    /// Returns the actor that is evaluated, without noise.
    fn greedy_actor(&self) -> Actor;

    /// Returns the layers of the [actor that is evaluated](Self::greedy_actor). Their outputs, through
    /// a hyperbolic tangent, are the greedy actions.
    fn greedy_layers(&self) -> Vec<LayerWeights>;

    /// Returns everything that the following updates depend on, to be saved or replaced.
    fn state_mut(&mut self) -> StateMut<'_>;
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

    /// Returns the sum of the losses of two parts.
    pub(crate) fn sum(first: Self, second: Self) -> Self {
        Self {
            critic: first.critic + second.critic,
            actor: first.actor + second.actor,
            value: first.value + second.value,
        }
    }
}

/// The number of parts of every batch. Their gradients are added in a fixed order, so that two
/// threads compute the same bits as one.
pub const PARTS: usize = 2;

/// The rows of a part of a batch.
#[derive(Clone, Copy)]
pub(crate) struct Part<'a> {
    /// The number of the part.
    pub(crate) number: usize,
    pub(crate) num_rows: usize,
    /// The number of rows of the whole batch.
    pub(crate) batch_len: usize,
    pub(crate) inputs: &'a [f32],
    pub(crate) actions: &'a [f32],
    pub(crate) rewards: &'a [f32],
    pub(crate) discounts: &'a [f32],
    pub(crate) next_inputs: &'a [f32],
}

/// Computes both parts of a batch, each with a workspace of its own, on the threads of the current
/// rayon pool.
pub(crate) fn in_parts<W: Send>(
    batch: &Batch<f32>,
    workspaces: &mut [W; PARTS],
    compute: impl Fn(Part<'_>, &mut W) + Sync,
) {
    let num_rows = batch.len() / PARTS;
    workspaces.par_iter_mut().enumerate().for_each(|(number, workspace)| {
        let column = |column| {
            let column: &[f32] = column;
            let len = column.len() / PARTS;
            &column[number * len..][..len]
        };
        let part = Part {
            number,
            num_rows,
            batch_len: batch.len(),
            inputs: column(batch.input()),
            actions: column(batch.action()),
            rewards: column(batch.reward()),
            discounts: column(batch.discount()),
            next_inputs: column(batch.next_input()),
        };
        compute(part, workspace);
    });
}

/// A network with its optimizer.
#[derive(Clone, Debug)]
pub(crate) struct Trained {
    pub(crate) network: Network,
    pub(crate) adam: Adam,
}

impl Trained {
    pub(crate) fn new(network: Network, learning_rate: f32) -> Self {
        let adam = Adam::new(learning_rate, network.parameters.len());
        Self { network, adam }
    }

    /// Takes step `number`, counted from 1, against the sum of gradients.
    pub(crate) fn step(&mut self, number: u64, gradients: [&[f32]; PARTS]) {
        self.adam.step(number, &mut self.network.parameters, gradients);
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
