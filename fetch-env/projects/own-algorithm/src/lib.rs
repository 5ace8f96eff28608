//! Twin delayed deep deterministic policy gradient (TD3) as an algorithm of `baselines::learn`:
//! the trainer provides the environments, the relabeling, the evaluation and the checkpoints.
//!
//! Source: Fujimoto et al., *Addressing function approximation error in actor-critic methods*,
//! 2018. The networks are small and written as plain loops, so that everything can be read here.

use baselines::LayerWeights;
use baselines::learn::{
    Algorithm, AlgorithmInit, AlgorithmSettings, Losses, StateMut, TrainError, Transitions,
};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

/// Settings of [`Td3`]. The defaults are for Reach.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Td3Settings {
    pub hidden: Vec<usize>,
    pub learning_rate: f32,
    pub gamma: f64,
    /// The fraction of the way that target networks move towards the learning ones.
    pub target_fraction: f32,
    /// The standard deviation of the noise that explores.
    pub noise: f32,
    /// The standard deviation of the noise of target actions, and its bound.
    pub target_noise: f32,
    pub target_noise_clip: f32,
    /// The number of updates of the critics for each update of the actor.
    pub actor_interval: u64,
}

impl Default for Td3Settings {
    fn default() -> Self {
        Self {
            hidden: vec![64, 64],
            learning_rate: 0.001,
            gamma: 0.95,
            target_fraction: 0.05,
            noise: 0.1,
            target_noise: 0.2,
            target_noise_clip: 0.5,
            actor_interval: 2,
        }
    }
}

impl Td3Settings {
    /// Returns these settings as the algorithm settings of a run.
    ///
    /// # Errors
    /// The errors of writing JSON.
    pub fn to_algorithm(&self) -> serde_json::Result<AlgorithmSettings> {
        serde_json::to_value(self).map(AlgorithmSettings::Other)
    }
}

/// Builds the algorithm, for `Trainer::with_algorithm` and `Trainer::resume_with_algorithm`.
///
/// # Errors
/// [`TrainError::Algorithm`] if the settings are not those of [`Td3`].
pub fn build(
    settings: &AlgorithmSettings,
    init: AlgorithmInit,
) -> Result<Box<dyn Algorithm>, TrainError> {
    let AlgorithmSettings::Other(value) = settings else {
        return Err(TrainError::Algorithm("the settings are not TD3's".into()));
    };
    match Td3Settings::deserialize(value) {
        Ok(settings) => Ok(Box::new(Td3::new(settings, init))),
        Err(error) => Err(TrainError::Algorithm(error.into())),
    }
}

/// A multilayer perceptron with rectified linear units that learns with Adam.
#[derive(Debug)]
struct Learning {
    /// The lengths of the input, of the hidden layers and of the output.
    sizes: Vec<usize>,
    /// The weights of each layer, a row for each input, and its biases.
    parameters: Vec<f32>,
    /// The parameters of the target network, which follows this one.
    target: Vec<f32>,
    first_moment: Vec<f32>,
    second_moment: Vec<f32>,
}

impl Learning {
    /// Draws parameters from `[-1 / sqrt(inputs), 1 / sqrt(inputs)]`.
    fn new(sizes: Vec<usize>, rng: &mut impl Rng) -> Self {
        let mut parameters = Vec::new();
        for pair in sizes.windows(2) {
            let bound = 1.0 / (pair[0] as f32).sqrt();
            let len = (pair[0] + 1) * pair[1];
            parameters.extend((0..len).map(|_| rng.random_range(-bound..=bound)));
        }
        let zeros = vec![0.0; parameters.len()];
        let target = parameters.clone();
        Self { sizes, parameters, target, first_moment: zeros.clone(), second_moment: zeros }
    }

    /// Takes step `number`, counted from 1, against a gradient, and lets the target follow.
    fn step(&mut self, number: u64, gradient: &[f32], settings: &Td3Settings) {
        let correction = |beta: f32| 1.0 - beta.powf(number as f32);
        let rate = settings.learning_rate * correction(0.999).sqrt() / correction(0.9);
        let moments = self.first_moment.iter_mut().zip(&mut self.second_moment);
        let parameters = self.parameters.iter_mut().zip(&mut self.target);
        for (((parameter, target), (first, second)), slope) in parameters.zip(moments).zip(gradient)
        {
            *first = 0.9 * *first + 0.1 * slope;
            *second = 0.999 * *second + 0.001 * slope * slope;
            *parameter -= rate * *first / (second.sqrt() + 1e-8);
            *target += settings.target_fraction * (*parameter - *target);
        }
    }

    fn run(&self, inputs: Vec<f32>) -> Pass<'_> {
        Pass::run(&self.sizes, &self.parameters, inputs)
    }

    fn run_target(&self, inputs: Vec<f32>) -> Pass<'_> {
        Pass::run(&self.sizes, &self.target, inputs)
    }

    fn push_to<'a>(&'a mut self, name: &str, state: &mut StateMut<'a>) {
        for (part, vector) in [
            ("parameters", &mut self.parameters),
            ("target", &mut self.target),
            ("first_moment", &mut self.first_moment),
            ("second_moment", &mut self.second_moment),
        ] {
            state.vectors.push((format!("{name}.{part}"), vector));
        }
    }
}

/// Returns the number of inputs, the weights and the biases of each layer.
fn layers<'a>(
    sizes: &'a [usize],
    mut parameters: &'a [f32],
) -> impl Iterator<Item = (usize, &'a [f32], &'a [f32])> {
    sizes.windows(2).map(move |pair| {
        let (weights, others) = parameters.split_at(pair[0] * pair[1]);
        let (biases, others) = others.split_at(pair[1]);
        parameters = others;
        (pair[0], weights, biases)
    })
}

/// What a network has computed for some rows.
struct Pass<'a> {
    sizes: &'a [usize],
    parameters: &'a [f32],
    /// The inputs, and the outputs of each layer.
    outputs: Vec<Vec<f32>>,
}

impl<'a> Pass<'a> {
    fn run(sizes: &'a [usize], parameters: &'a [f32], inputs: Vec<f32>) -> Self {
        let mut outputs = vec![inputs];
        for (number, (num_inputs, weights, biases)) in layers(sizes, parameters).enumerate() {
            let mut layer = Vec::new();
            for input in outputs[number].chunks_exact(num_inputs) {
                let start = layer.len();
                layer.extend_from_slice(biases);
                let output = &mut layer[start..];
                for (x, weights) in input.iter().zip(weights.chunks_exact(biases.len())) {
                    output.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += x * weight);
                }
                if number + 2 < sizes.len() {
                    output.iter_mut().for_each(|value| *value = value.max(0.0));
                }
            }
            outputs.push(layer);
        }
        Self { sizes, parameters, outputs }
    }

    fn outputs(&self) -> &[f32] {
        &self.outputs[self.outputs.len() - 1]
    }

    /// Returns the gradients of the parameters and of the inputs, given that of the outputs.
    fn backward(&self, mut slopes: Vec<f32>) -> (Vec<f32>, Vec<f32>) {
        let mut gradient = Vec::new();
        let layers: Vec<_> = layers(self.sizes, self.parameters).collect();
        for (number, (num_inputs, weights, biases)) in layers.into_iter().enumerate().rev() {
            let num_outputs = biases.len();
            let mut of_layer = vec![0.0; weights.len() + num_outputs];
            let (by_weight, by_bias) = of_layer.split_at_mut(weights.len());
            let mut before = Vec::with_capacity(self.outputs[number].len());
            let rows = self.outputs[number].chunks_exact(num_inputs);
            for (input, slope) in rows.zip(slopes.chunks_exact(num_outputs)) {
                by_bias.iter_mut().zip(slope).for_each(|(sum, slope)| *sum += slope);
                let weights = weights.chunks_exact(num_outputs);
                let by_weight = by_weight.chunks_exact_mut(num_outputs);
                for ((x, weights), by_weight) in input.iter().zip(weights).zip(by_weight) {
                    by_weight.iter_mut().zip(slope).for_each(|(sum, slope)| *sum += x * slope);
                    let by_input = weights.iter().zip(slope).map(|(w, slope)| w * slope).sum();
                    // Where a rectified linear unit is at 0, so is its slope.
                    before.push(if number > 0 && *x <= 0.0 { 0.0 } else { by_input });
                }
            }
            gradient.splice(0..0, of_layer);
            slopes = before;
        }
        (gradient, slopes)
    }
}

#[derive(Debug)]
pub struct Td3 {
    settings: Td3Settings,
    init: AlgorithmInit,
    actor: Learning,
    critics: [Learning; 2],
    num_updates: u64,
}

impl Td3 {
    #[must_use]
    pub fn new(settings: Td3Settings, init: AlgorithmInit) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(init.seed);
        let mut learning = |num_inputs: usize, num_outputs: usize| {
            let sizes = [&[num_inputs], settings.hidden.as_slice(), &[num_outputs]].concat();
            Learning::new(sizes, &mut rng)
        };
        let AlgorithmInit { num_inputs, num_actions, .. } = init;
        Self {
            actor: learning(num_inputs, num_actions),
            critics: [(); 2].map(|()| learning(num_inputs + num_actions, 1)),
            settings,
            init,
            num_updates: 0,
        }
    }

    /// Returns the targets of the critics: the reward plus the discounted lower value of the next
    /// state, for an action near the target actor's.
    fn targets(&self, batch: Transitions<'_>) -> Vec<f32> {
        let Td3Settings { target_noise, target_noise_clip, .. } = self.settings;
        let mut rng = ChaCha8Rng::seed_from_u64(self.init.seed);
        // Stream 0 has drawn the first weights; each process has its own streams.
        rng.set_stream((self.init.rank as u64) << 48 | self.num_updates);
        let next = self.actor.run_target(batch.next_input.to_vec());
        let noisy = |output: &f32| {
            let noise = target_noise * rng.sample::<f32, _>(StandardNormal);
            (output.tanh() + noise.clamp(-target_noise_clip, target_noise_clip)).clamp(-1.0, 1.0)
        };
        let next_actions: Vec<f32> = next.outputs().iter().map(noisy).collect();
        let joined = self.joined(batch.next_input, &next_actions);
        let [first, second] = self.critics.each_ref().map(|it| it.run_target(joined.clone()));
        let values = first.outputs().iter().zip(second.outputs()).map(|(a, b)| a.min(*b));
        let rows = batch.reward.iter().zip(batch.discount).zip(values);
        rows.map(|((reward, discount), value)| reward + discount * value).collect()
    }

    /// Returns the gradient of a critic's mean squared error, followed by the error and the mean
    /// value.
    fn critic_gradient(critic: &Learning, joined: Vec<f32>, targets: &[f32]) -> Vec<f32> {
        let share = 1.0 / targets.len() as f32;
        let pass = critic.run(joined);
        let errors = || pass.outputs().iter().zip(targets).map(|(value, target)| value - target);
        let (mut gradient, _) = pass.backward(errors().map(|error| 2.0 * share * error).collect());
        gradient.push(share * errors().map(|error| error * error).sum::<f32>());
        gradient.push(share * pass.outputs().iter().sum::<f32>());
        gradient
    }

    /// Returns the gradient of the actor's loss, the negative mean value of its actions, followed
    /// by the loss.
    fn actor_gradient(&self, batch: Transitions<'_>) -> Vec<f32> {
        let share = 1.0 / batch.len as f32;
        let AlgorithmInit { num_inputs, num_actions, .. } = self.init;
        let pass = self.actor.run(batch.input.to_vec());
        let actions: Vec<f32> = pass.outputs().iter().map(|output| output.tanh()).collect();
        let values = self.critics[0].run(self.joined(batch.input, &actions));
        let (_, by_input) = values.backward(vec![-share; batch.len]);
        let by_action =
            by_input.chunks_exact(num_inputs + num_actions).flat_map(|row| &row[num_inputs..]);
        let slopes = by_action.zip(&actions).map(|(slope, action)| slope * (1.0 - action * action));
        let (mut gradient, _) = pass.backward(slopes.collect());
        gradient.push(-share * values.outputs().iter().sum::<f32>());
        gradient
    }

    /// Returns inputs, each followed by its action.
    fn joined(&self, inputs: &[f32], actions: &[f32]) -> Vec<f32> {
        let AlgorithmInit { num_inputs, num_actions, .. } = self.init;
        let rows = inputs.chunks_exact(num_inputs).zip(actions.chunks_exact(num_actions));
        rows.flat_map(|(input, action)| input.iter().chain(action)).copied().collect()
    }
}

impl Algorithm for Td3 {
    fn name(&self) -> &str {
        "td3"
    }

    fn gamma(&self) -> f64 {
        self.settings.gamma
    }

    fn update(&mut self, batch: Transitions<'_>, average: &mut dyn FnMut(&mut [f32])) -> Losses {
        self.num_updates += 1;
        let targets = self.targets(batch);
        let joined = self.joined(batch.input, batch.action);
        let mut losses = Losses::default();
        for critic in &mut self.critics {
            let mut gradient = Self::critic_gradient(critic, joined.clone(), &targets);
            average(&mut gradient);
            let [.., loss, value] = gradient[..] else { continue };
            losses.critic += loss;
            losses.value += 0.5 * value;
            critic.step(self.num_updates, &gradient, &self.settings);
        }
        if self.num_updates.is_multiple_of(self.settings.actor_interval) {
            let mut gradient = self.actor_gradient(batch);
            average(&mut gradient);
            losses.actor = gradient.last().copied().unwrap_or_default();
            let number = self.num_updates / self.settings.actor_interval;
            self.actor.step(number, &gradient, &self.settings);
        }
        losses
    }

    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        let pass = self.actor.run(inputs.to_vec());
        for ((action, output), noise) in actions.iter_mut().zip(pass.outputs()).zip(noise) {
            *action = (output.tanh() + self.settings.noise * noise).clamp(-1.0, 1.0);
        }
    }

    fn greedy_layers(&self) -> Vec<LayerWeights> {
        let layer = |(num_inputs, weights, biases): (usize, &[f32], &[f32])| LayerWeights {
            num_inputs,
            weights: weights.to_vec(),
            biases: biases.to_vec(),
        };
        layers(&self.actor.sizes, &self.actor.parameters).map(layer).collect()
    }

    fn state_mut(&mut self) -> StateMut<'_> {
        let Self { actor, critics: [first, second], num_updates, .. } = self;
        let mut state = StateMut { num_updates, vectors: Vec::new() };
        actor.push_to("actor", &mut state);
        first.push_to("critic_1", &mut state);
        second.push_to("critic_2", &mut state);
        state
    }
}
