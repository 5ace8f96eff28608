//! The networks that a distiller trains.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::learn::algorithm::state_file::{StateFault, StateForm, Vectors};
#[cfg(feature = "render")]
use crate::network::PictureShape;
use crate::network::adam::Adam;
use crate::network::pass::Pass;
use crate::network::perceptron::{Network, Shape};
use crate::network::{PictureNetwork, PicturePass};
use crate::tanh::tanh;

/// A network, whatever it sees.
#[derive(Clone)]
pub(in crate::learn) enum StudentNetwork {
    /// Sees the numbers alone.
    State(Network),
    /// Sees a picture, too.
    #[cfg_attr(not(feature = "render"), expect(dead_code, reason = "there are no pictures"))]
    Pixels(PictureNetwork),
}

/// A pass through either network.
#[derive(Default)]
struct EitherPass {
    state: Pass,
    pixels: PicturePass,
}

/// A network that learns, and its average.
pub(in crate::learn) struct Student {
    /// Acts in rounds, so that they reach states where it still errs.
    learning: StudentNetwork,
    /// Is evaluated.
    pub(in crate::learn) averaged: StudentNetwork,
    adam: Adam,
    average_fraction: f32,
    pass: EitherPass,
    gradient: Vec<f32>,
}

impl StudentNetwork {
    fn parameters_mut(&mut self) -> &mut [f32] {
        match self {
            Self::State(network) => &mut network.parameters,
            Self::Pixels(network) => network.parameters_mut(),
        }
    }

    fn follow(&mut self, other: &Self, fraction: f32) {
        match (self, other) {
            (Self::State(own), Self::State(other)) => own.follow(other, fraction),
            (Self::Pixels(own), Self::Pixels(other)) => own.follow(other, fraction),
            // Never: one is made of the other.
            _ => {}
        }
    }

    /// Returns the length of a picture in bytes.
    fn picture_len(&self) -> usize {
        match self {
            Self::State(_) => 0,
            Self::Pixels(network) => network.shape().picture_len(),
        }
    }

    /// Returns the parameters, and all else that was learned, each with its name.
    fn vectors_mut(&mut self) -> Vec<(&'static str, &mut Vec<f32>)> {
        match self {
            Self::State(network) => network.vectors_mut().into(),
            Self::Pixels(network) => network.vectors_mut().into(),
        }
    }
}

impl EitherPass {
    fn run(&mut self, network: &StudentNetwork, pictures: &[u8], numbers: &[f32]) -> &[f32] {
        match network {
            StudentNetwork::State(network) => self.state.run(network, numbers),
            StudentNetwork::Pixels(network) => self.pixels.run(network, pictures, numbers),
        }
    }

    fn backward(
        &mut self,
        network: &StudentNetwork,
        slope: impl Fn(usize, f32) -> f32,
        gradient: &mut [f32],
    ) {
        match network {
            StudentNetwork::State(network) => {
                self.state.backward(network, slope, Some(gradient), 0);
            }
            StudentNetwork::Pixels(network) => self.pixels.backward(network, slope, gradient),
        }
    }
}

impl Student {
    /// Draws a student that sees numbers alone.
    pub(super) fn of_state(shape: Shape, [rate, average]: [f32; 2], seed: u64) -> Self {
        let network = Network::init(shape, 1.0, &mut ChaCha8Rng::seed_from_u64(seed));
        Self::new(StudentNetwork::State(network), rate, average)
    }

    /// Draws a student that sees pictures and numbers.
    #[cfg(feature = "render")]
    pub(in crate::learn) fn of_pixels(
        shape: PictureShape,
        [rate, average]: [f32; 2],
        seed: u64,
    ) -> Self {
        let network = PictureNetwork::init(shape, &mut ChaCha8Rng::seed_from_u64(seed));
        Self::new(StudentNetwork::Pixels(network), rate, average)
    }

    fn new(mut network: StudentNetwork, learning_rate: f32, average_fraction: f32) -> Self {
        let len = network.parameters_mut().len();
        Self {
            averaged: network.clone(),
            learning: network,
            adam: Adam::new(learning_rate, len),
            average_fraction,
            pass: EitherPass::default(),
            gradient: vec![0.0; len],
        }
    }

    /// Sets the scale of pictures, from some of them.
    pub(in crate::learn) fn measure(&mut self, pictures: &[u8]) {
        for network in [&mut self.learning, &mut self.averaged] {
            if let StudentNetwork::Pixels(network) = network {
                network.measure(pictures);
            }
        }
    }

    /// Returns the length of the pictures that it sees, in bytes.
    pub(in crate::learn) fn picture_len(&self) -> usize {
        self.learning.picture_len()
    }

    /// Returns all that was learned.
    fn vectors_mut(&mut self) -> Vectors<'_> {
        let Self { learning, averaged, adam, .. } = self;
        let learning = learning.vectors_mut().into_iter().chain(adam.vectors_mut());
        let learning = learning.map(|(name, vector)| (format!("learning.{name}"), vector));
        let averaged = averaged.vectors_mut().into_iter();
        learning
            .chain(averaged.map(|(name, vector)| (format!("averaged.{name}"), vector)))
            .collect()
    }

    /// Returns all that was learned as a file, or why it could not be read again.
    pub(in crate::learn) fn write(&mut self) -> Result<Vec<u8>, String> {
        let vectors = self.vectors_mut();
        StateForm::of(&vectors)?.write(vectors)
    }

    /// Replaces all that was learned by that of a file.
    pub(in crate::learn) fn restore(&mut self, file: &[u8]) -> Result<(), StateFault> {
        let vectors = self.vectors_mut();
        StateForm::of(&vectors).map_err(StateFault::Foreign)?.restore(vectors, file)
    }

    /// Writes the actions of the learning network for pictures and numbers, a row for each.
    pub(super) fn explore(&mut self, pictures: &[u8], numbers: &[f32], actions: &mut [f32]) {
        act(self.pass.run(&self.learning, pictures, numbers), actions);
    }

    /// Writes the average's actions, otherwise as [`explore`](Self::explore).
    pub(in crate::learn) fn act(&mut self, pictures: &[u8], numbers: &[f32], actions: &mut [f32]) {
        act(self.pass.run(&self.averaged, pictures, numbers), actions);
    }

    /// Takes step `number`, counted from 1, down the loss of actions for pictures and numbers, which
    /// `loss` returns. It replaces the actions by the derivatives of the loss with respect to them.
    pub(in crate::learn) fn update(
        &mut self,
        number: u64,
        pictures: &[u8],
        numbers: &[f32],
        loss: impl FnOnce(&mut [f32]) -> f32,
    ) -> f32 {
        let Self { learning, averaged, adam, pass, gradient, .. } = self;
        let outputs = pass.run(learning, pictures, numbers);
        let actions: Vec<f32> = outputs.iter().map(|output| tanh(*output)).collect();
        let mut slopes = actions.clone();
        let loss = loss(&mut slopes);
        let slope = |index: usize, _| slopes[index] * (1.0 - actions[index] * actions[index]);
        pass.backward(learning, slope, gradient);
        adam.step(number, 1.0, learning.parameters_mut(), gradient);
        // At first, the average of about the last tenth of all updates.
        let early = 9.0 / (number as f32 + 9.0);
        averaged.follow(learning, self.average_fraction.max(early));
        loss
    }
}

fn act(outputs: &[f32], actions: &mut [f32]) {
    actions.iter_mut().zip(outputs).for_each(|(action, output)| *action = tanh(*output));
}

/// Returns the mean squared error of actions, and replaces them by its derivatives.
pub(super) fn squared_error(actions: &mut [f32], targets: &[f32]) -> f32 {
    let share = 1.0 / targets.len() as f32;
    let mut loss = 0.0;
    for (action, target) in actions.iter_mut().zip(targets) {
        let error = *action - target;
        loss += error * error;
        *action = 2.0 * share * error;
    }
    loss * share
}
