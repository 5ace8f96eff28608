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
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

/// The fraction of the way that target networks move towards the learning ones.
const TARGET_FRACTION: f32 = 0.05;
/// The standard deviation of the noise of target actions, and its bound.
const TARGET_NOISE: f32 = 0.2;
const TARGET_NOISE_CLIP: f32 = 0.5;

/// Settings of [`Td3`]. The defaults are for Reach.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Td3Settings {
    pub hidden: Vec<usize>,
    pub learning_rate: f32,
    pub gamma: f64,
    /// The standard deviation of the noise that explores.
    pub noise: f32,
    /// The number of updates of the critics for each update of the actor.
    pub actor_interval: u64,
}

impl Default for Td3Settings {
    fn default() -> Self {
        Self {
            hidden: vec![64, 64],
            learning_rate: 0.001,
            gamma: 0.95,
            noise: 0.1,
            actor_interval: 2,
        }
    }
}

/// Builds the algorithm, for `Trainer::with_algorithm` and `Trainer::resume_with_algorithm`.
pub fn build(
    settings: &AlgorithmSettings,
    init: AlgorithmInit,
) -> Result<Box<dyn Algorithm>, TrainError> {
    Ok(Box::new(Td3::new(settings.read_other()?, init)))
}

/// A network that learns, and the target network that follows it.
#[derive(Debug)]
struct Learning {
    trained: Trained,
    target: Network,
    pass: Pass,
    gradient: Vec<f32>,
}

impl Learning {
    fn new(shape: Shape, learning_rate: f32, rng: &mut impl Rng) -> Self {
        let gradient = vec![0.0; shape.num_parameters()];
        let target = Network::init(shape, 1.0, rng);
        let trained = Trained::new(target.clone(), learning_rate);
        Self { trained, target, pass: Pass::default(), gradient }
    }

    /// Takes step `number`, counted from 1, against the gradient, and lets the target follow.
    fn step(&mut self, number: u64, average: &mut dyn FnMut(&mut [f32])) {
        average(&mut self.gradient);
        self.trained.step(number, 1.0, &self.gradient);
        self.target.follow(self.trained.network(), TARGET_FRACTION);
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
        let mut rng = init.weights_rng();
        let mut learning = |num_inputs: usize, num_outputs: usize| {
            let shape = Shape::new(num_inputs, &settings.hidden, num_outputs, false);
            Learning::new(shape, settings.learning_rate, &mut rng)
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
    fn targets(&mut self, batch: Transitions<'_>) -> Vec<f32> {
        let mut rng = self.init.noise_rng(self.num_updates);
        let noisy = |output: &f32| {
            let noise = TARGET_NOISE * rng.sample::<f32, _>(StandardNormal);
            (output.tanh() + noise.clamp(-TARGET_NOISE_CLIP, TARGET_NOISE_CLIP)).clamp(-1.0, 1.0)
        };
        let Self { actor, critics: [first, second], .. } = self;
        let next = actor.pass.run(&actor.target, batch.next_actor_input);
        let actions: Vec<f32> = next.iter().map(noisy).collect();
        let values = first.pass.run_joined(&first.target, batch.next_input, &actions);
        let others = second.pass.run_joined(&second.target, batch.next_input, &actions);
        let lower = values.iter().zip(others).map(|(value, other)| value.min(*other));
        batch.targets(lower).collect()
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
        let Self { settings, actor, critics, num_updates, .. } = self;
        let share = 1.0 / batch.len as f32;
        let mut losses = Losses::default();
        for critic in &mut *critics {
            let Learning { trained, pass, gradient, .. } = critic;
            let mut means = batch.regress(pass, trained.network(), &targets, gradient);
            average(&mut means);
            losses.critic += means[0];
            losses.value += 0.5 * means[1];
            critic.step(*num_updates, average);
        }
        if num_updates.is_multiple_of(settings.actor_interval) {
            let outputs = actor.pass.run(actor.trained.network(), batch.actor_input);
            let actions: Vec<f32> = outputs.iter().map(|output| output.tanh()).collect();
            let [critic, _] = critics;
            let network = critic.trained.network();
            let values = critic.pass.run_joined(network, batch.input, &actions);
            let mut loss = [-share * values.iter().sum::<f32>()];
            average(&mut loss);
            losses.actor = loss[0];
            let by_action =
                critic.pass.backward(network, |_, _| -share, None, self.init.num_actions);
            let slope = |at: usize, _| by_action[at] * (1.0 - actions[at] * actions[at]);
            actor.pass.backward(actor.trained.network(), slope, Some(&mut actor.gradient), 0);
            actor.step(*num_updates / settings.actor_interval, average);
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
