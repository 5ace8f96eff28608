//! Twin delayed deep deterministic policy gradient (TD3) as an algorithm of `baselines::learn`:
//! the environments, the relabeling, the evaluation and the checkpoints are the trainer's.
//!
//! Source: Fujimoto et al., *Addressing function approximation error in actor-critic methods*,
//! 2018. The networks are small and in plain loops, so that everything can be read here.

mod network;

use baselines::LayerWeights;
use baselines::learn::{
    Algorithm, AlgorithmInit, AlgorithmSettings, Losses, StateMut, TrainError, Transitions,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use network::{Adam, Network, Pass};

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
    /// The number of updates of the critics for each of the actor.
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
    /// Returns the settings as those of a run.
    ///
    /// # Errors
    /// Those of writing JSON.
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
    let settings = Td3Settings::deserialize(value);
    let settings = settings.map_err(|error| TrainError::Algorithm(error.into()))?;
    Ok(Box::new(Td3::new(settings, init)))
}

/// A network that learns: its optimizer, and the network that follows it.
#[derive(Debug)]
struct Learning {
    network: Network,
    adam: Adam,
    target: Network,
}

impl Learning {
    fn new(network: Network, learning_rate: f32) -> Self {
        let adam = Adam::new(learning_rate, network.parameters.len());
        Self { adam, target: network.clone(), network }
    }

    fn step(&mut self, number: u64, gradient: &[f32], target_fraction: f32) {
        self.adam.step(number, &mut self.network.parameters, gradient);
        let followed = self.target.parameters.iter_mut().zip(&self.network.parameters);
        followed.for_each(|(target, parameter)| *target += target_fraction * (parameter - *target));
    }

    fn push_to<'a>(&'a mut self, name: &str, state: &mut StateMut<'a>) {
        for (part, vector) in [
            ("parameters", &mut self.network.parameters),
            ("target", &mut self.target.parameters),
            ("first_moment", &mut self.adam.first_moment),
            ("second_moment", &mut self.adam.second_moment),
        ] {
            state.vectors.push((format!("{name}.{part}"), vector));
        }
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
            Learning::new(Network::new(sizes, &mut rng), settings.learning_rate)
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

    /// Returns what the critics should say: the reward, and the discounted lower value of the next
    /// state, for an action near the target actor's.
    fn targets(&self, batch: Transitions<'_>) -> Vec<f32> {
        let Td3Settings { target_noise, target_noise_clip, .. } = self.settings;
        let mut rng = ChaCha8Rng::seed_from_u64(self.init.seed);
        // Stream 0 has drawn the first weights; each process has streams of its own.
        rng.set_stream((self.init.rank as u64) << 48 | self.num_updates);
        let next = Pass::run(&self.actor.target, batch.next_input.to_vec());
        let next_actions: Vec<f32> = next
            .outputs()
            .iter()
            .map(|output| {
                let noise = target_noise * rng.sample::<f32, _>(StandardNormal);
                let noise = noise.clamp(-target_noise_clip, target_noise_clip);
                (output.tanh() + noise).clamp(-1.0, 1.0)
            })
            .collect();
        let joined = self.joined(batch.next_input, &next_actions);
        let [first, second] =
            [0, 1].map(|index| Pass::run(&self.critics[index].target, joined.clone()));
        let values = first.outputs().iter().zip(second.outputs()).map(|(a, b)| a.min(*b));
        let rows = batch.reward.iter().zip(batch.discount).zip(values);
        rows.map(|((reward, discount), value)| reward + discount * value).collect()
    }

    /// Returns the gradient of a critic, of its mean squared error, behind it the error and the
    /// mean value.
    fn critic_gradient(critic: &Network, joined: Vec<f32>, targets: &[f32]) -> Vec<f32> {
        let share = 1.0 / targets.len() as f32;
        let pass = Pass::run(critic, joined);
        let errors = || pass.outputs().iter().zip(targets).map(|(value, target)| value - target);
        let slopes: Vec<f32> = errors().map(|error| 2.0 * share * error).collect();
        let (mut gradient, _) = pass.backward(critic, &slopes);
        gradient.push(share * errors().map(|error| error * error).sum::<f32>());
        gradient.push(share * pass.outputs().iter().sum::<f32>());
        gradient
    }

    /// Returns the gradient of the actor, of the negative mean value of its actions, and behind it
    /// that loss.
    fn actor_gradient(&self, batch: Transitions<'_>) -> Vec<f32> {
        let share = 1.0 / batch.len as f32;
        let AlgorithmInit { num_inputs, num_actions, .. } = self.init;
        let pass = Pass::run(&self.actor.network, batch.input.to_vec());
        let actions: Vec<f32> = pass.outputs().iter().map(|output| output.tanh()).collect();
        let critic = &self.critics[0].network;
        let values = Pass::run(critic, self.joined(batch.input, &actions));
        let (_, by_input) = values.backward(critic, &vec![-share; batch.len]);
        let by_action =
            by_input.chunks_exact(num_inputs + num_actions).flat_map(|row| &row[num_inputs..]);
        let slopes: Vec<f32> = by_action
            .zip(&actions)
            .map(|(slope, action)| slope * (1.0 - action * action))
            .collect();
        let (mut gradient, _) = pass.backward(&self.actor.network, &slopes);
        gradient.push(-share * values.outputs().iter().sum::<f32>());
        gradient
    }

    /// Returns inputs with their actions behind them.
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
        let fraction = self.settings.target_fraction;
        let targets = self.targets(batch);
        let joined = self.joined(batch.input, batch.action);
        let mut losses = Losses::default();
        for critic in &mut self.critics {
            let mut gradient = Self::critic_gradient(&critic.network, joined.clone(), &targets);
            average(&mut gradient);
            let [.., loss, value] = gradient[..] else { continue };
            losses.critic += loss;
            losses.value += 0.5 * value;
            critic.step(self.num_updates, &gradient, fraction);
        }
        if self.num_updates.is_multiple_of(self.settings.actor_interval) {
            let mut gradient = self.actor_gradient(batch);
            average(&mut gradient);
            losses.actor = gradient.last().copied().unwrap_or_default();
            let number = self.num_updates / self.settings.actor_interval;
            self.actor.step(number, &gradient, fraction);
        }
        losses
    }

    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        let pass = Pass::run(&self.actor.network, inputs.to_vec());
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
        self.actor.network.layers().map(layer).collect()
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
