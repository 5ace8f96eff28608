//! Twin delayed deep deterministic policy gradient (TD3) as an algorithm of `baselines::learn`:
//! the trainer provides the environments, the relabeling, the evaluation and the checkpoints.
//!
//! Source: Fujimoto et al., *Addressing function approximation error in actor-critic methods*,
//! 2018. Networks, their gradients and the optimizer are those of `baselines::learn::network`.

use baselines::LayerWeights;
use baselines::learn::network::{Network, Pass, Shape, Trained};
use baselines::learn::{
    Algorithm, AlgorithmInit, AlgorithmSettings, Losses, StateMut, TrainError, Transitions,
};
use rand::{RngExt, SeedableRng};
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

/// A network that learns, and the target network that follows it.
#[derive(Debug)]
struct Learning {
    trained: Trained,
    target: Network,
    pass: Pass,
    /// The gradient of the parameters, and then the losses: processes average both.
    gradient: Vec<f32>,
}

impl Learning {
    fn new(shape: Shape, num_losses: usize, learning_rate: f32, rng: &mut ChaCha8Rng) -> Self {
        let gradient = vec![0.0; shape.num_parameters() + num_losses];
        let network = Network::init(shape, 1.0, rng);
        let target = network.clone();
        let trained = Trained::new(network, learning_rate);
        Self { trained, target, pass: Pass::default(), gradient }
    }

    /// Computes the gradient of a loss from its slopes with respect to the last outputs.
    fn backward(&mut self, losses: &[f32], slope: impl Fn(usize, f32) -> f32) {
        let len = self.gradient.len() - losses.len();
        let (gradient, rest) = self.gradient.split_at_mut(len);
        self.pass.backward(self.trained.network(), slope, Some(gradient), 0);
        rest.copy_from_slice(losses);
    }

    /// Takes step `number`, counted from 1, against the gradient, and lets the target follow.
    /// Returns the losses.
    fn step(&mut self, number: u64, target_fraction: f32) -> &[f32] {
        let len = self.target.shape().num_parameters();
        self.trained.step(number, 1.0, &self.gradient[..len]);
        self.target.follow(self.trained.network(), target_fraction);
        &self.gradient[len..]
    }

    fn push_to<'a>(&'a mut self, name: &str, state: &mut StateMut<'a>) {
        state.push(name, self.trained.vectors_mut());
        state.push(&format!("target_{name}"), self.target.vectors_mut());
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
        let mut learning = |num_inputs: usize, num_outputs: usize, num_losses: usize| {
            let shape = Shape::new(num_inputs, &settings.hidden, num_outputs, false);
            Learning::new(shape, num_losses, settings.learning_rate, &mut rng)
        };
        let AlgorithmInit { num_inputs, num_actions, .. } = init;
        Self {
            actor: learning(num_inputs, num_actions, 1),
            critics: [(); 2].map(|()| learning(num_inputs + num_actions, 1, 2)),
            settings,
            init,
            num_updates: 0,
        }
    }

    /// Returns the targets of the critics: the reward plus the discounted lower value of the next
    /// state, for an action near the target actor's.
    fn targets(&mut self, batch: Transitions<'_>) -> Vec<f32> {
        let Td3Settings { target_noise, target_noise_clip, .. } = self.settings;
        let mut rng = ChaCha8Rng::seed_from_u64(self.init.seed);
        // Stream 0 has drawn the first weights; each process has its own streams.
        rng.set_stream((self.init.rank as u64) << 48 | self.num_updates);
        let noisy = |output: &f32| {
            let noise = target_noise * rng.sample::<f32, _>(StandardNormal);
            (output.tanh() + noise.clamp(-target_noise_clip, target_noise_clip)).clamp(-1.0, 1.0)
        };
        let Self { actor, critics: [first, second], .. } = self;
        let next = actor.pass.run(&actor.target, batch.next_input);
        let actions: Vec<f32> = next.iter().map(noisy).collect();
        let values = first.pass.run_joined(&first.target, batch.next_input, &actions);
        let others = second.pass.run_joined(&second.target, batch.next_input, &actions);
        let values = values.iter().zip(others).map(|(value, other)| value.min(*other));
        let rows = batch.reward.iter().zip(batch.discount).zip(values);
        rows.map(|((reward, discount), value)| reward + discount * value).collect()
    }

    /// Computes the gradient of a critic's mean squared error, and the error and the mean value.
    fn critic_gradient(critic: &mut Learning, batch: Transitions<'_>, targets: &[f32]) {
        let share = 1.0 / batch.len as f32;
        let network = critic.trained.network();
        let values = critic.pass.run_joined(network, batch.input, batch.action);
        let errors = values.iter().zip(targets).map(|(value, target)| value - target);
        let loss = share * errors.map(|error| error * error).sum::<f32>();
        let value = share * values.iter().sum::<f32>();
        critic.backward(&[loss, value], |row, value| 2.0 * share * (value - targets[row]));
    }

    /// Computes the gradient of the actor's loss, the negative mean value of its actions, and the
    /// loss.
    fn actor_gradient(&mut self, batch: Transitions<'_>) {
        let share = 1.0 / batch.len as f32;
        let Self { actor, critics: [critic, _], .. } = self;
        let outputs = actor.pass.run(actor.trained.network(), batch.input);
        let actions: Vec<f32> = outputs.iter().map(|output| output.tanh()).collect();
        let network = critic.trained.network();
        let values = critic.pass.run_joined(network, batch.input, &actions);
        let loss = -share * values.iter().sum::<f32>();
        let num_actions = self.init.num_actions;
        let by_action = critic.pass.backward(network, |_, _| -share, None, num_actions);
        actor.backward(&[loss], |index, _| {
            by_action[index] * (1.0 - actions[index] * actions[index])
        });
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
        let mut losses = Losses::default();
        for critic in &mut self.critics {
            Self::critic_gradient(critic, batch, &targets);
            average(&mut critic.gradient);
            let [loss, value] = *critic.step(self.num_updates, self.settings.target_fraction)
            else {
                continue;
            };
            losses.critic += loss;
            losses.value += 0.5 * value;
        }
        if self.num_updates.is_multiple_of(self.settings.actor_interval) {
            self.actor_gradient(batch);
            average(&mut self.actor.gradient);
            let number = self.num_updates / self.settings.actor_interval;
            losses.actor = self.actor.step(number, self.settings.target_fraction)[0];
        }
        losses
    }

    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        let outputs = self.actor.pass.run(self.actor.trained.network(), inputs);
        for ((action, output), noise) in actions.iter_mut().zip(outputs).zip(noise) {
            *action = (output.tanh() + self.settings.noise * noise).clamp(-1.0, 1.0);
        }
    }

    fn greedy_layers(&self) -> Vec<LayerWeights> {
        self.actor.trained.network().layer_weights()
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
