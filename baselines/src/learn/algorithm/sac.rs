//! Soft actor-critic.

use rand::Rng;

use super::critic::{Gradients, debug_settings};
use super::interface::{Algorithm, AlgorithmInit, Losses, StateMut, Transitions};
use super::sampled::{Sampled, clamp_log_std};
use crate::learn::error::TrainError;
use crate::learn::settings::algorithm::SacSettings;
use crate::network::adam::{Adam, Trained};
use crate::network::pass::Pass;
use crate::network::perceptron::{Network, Shape};
use crate::tanh::tanh;
use crate::trained::LayerWeights;

/// Soft actor-critic: two critics learn the value of actions plus the entropy of the policy, and an
/// actor learns a distribution of actions. The temperature is learned, too, or fixed.
///
/// Source: Haarnoja et al., 2018, as in [`SacSettings`].
pub struct Sac {
    settings: SacSettings,
    networks: Networks,
    log_temperature: Vec<f32>,
    temperature_adam: Adam,
    /// The gradients of both critics and of the actor, and means: the losses of the critics and of
    /// the actor, the value, the logarithm of the actions' density, the values of both critics, and
    /// the target.
    gradients: Gradients<4>,
    critic_work: Work,
    actor_work: Work,
    num_updates: u64,
    init: AlgorithmInit,
}

struct Networks {
    actor: Trained,
    critics: [Trained; 2],
    targets: [Network; 2],
}

debug_settings!(Sac);

/// The passes and vectors that a gradient is computed with; they are reused.
#[derive(Default)]
struct Work {
    actor: Pass,
    critics: [Pass; 2],
    sample: Sampled,
    targets: Vec<f32>,
}

impl Sac {
    /// Creates networks with initial weights and noise that `init.seed` determines.
    ///
    /// # Errors
    /// [`TrainError::Setting`] if a setting is out of its range, `init.num_inputs` is not from 1 to
    /// 16,384, `init.num_actions` is not from 1 to 1,024, or `init.reward_bounds` is empty.
    pub fn new(settings: SacSettings, init: AlgorithmInit) -> Result<Self, TrainError> {
        settings.check()?;
        init.check()?;
        let AlgorithmInit { num_inputs, num_actions, .. } = init;
        let mut rng = init.weights_rng();
        let SacSettings { hidden, layer_norm, last_layer_scale, learning_rate, .. } = &settings;
        let actor = Shape::new(num_inputs, hidden, 2 * num_actions, false);
        let actor = Network::init(actor, *last_layer_scale, &mut rng);
        let critic = Shape::new(num_inputs + num_actions, hidden, 1, *layer_norm);
        let targets = [(); 2].map(|()| Network::init(critic.clone(), 1.0, &mut rng));
        let critic_len = critic.num_parameters();
        Ok(Self {
            gradients: Gradients::new([critic_len, critic_len, actor.parameters.len(), 7]),
            networks: Networks {
                actor: Trained::new(actor, *learning_rate),
                critics: targets.clone().map(|critic| Trained::new(critic, *learning_rate)),
                targets,
            },
            log_temperature: vec![libm::logf(settings.initial_temperature)],
            temperature_adam: Adam::new(*learning_rate, 1),
            critic_work: Work::default(),
            actor_work: Work::default(),
            settings,
            num_updates: 0,
            init,
        })
    }
}

impl Algorithm for Sac {
    fn name(&self) -> &str {
        "sac"
    }

    fn gamma(&self) -> f64 {
        self.settings.gamma
    }

    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        let actor = &self.networks.actor.network;
        let num_actions = actions.len() / (inputs.len() / actor.shape.num_inputs());
        let outputs = self.actor_work.actor.run(actor, inputs).chunks_exact(2 * num_actions);
        let rows = actions.chunks_exact_mut(num_actions).zip(noise.chunks_exact(num_actions));
        for ((actions, noise), outputs) in rows.zip(outputs) {
            let (means, log_stds) = outputs.split_at(num_actions);
            for (((action, noise), mean), log_std) in
                actions.iter_mut().zip(noise).zip(means).zip(log_stds)
            {
                *action = tanh(mean + libm::expf(clamp_log_std(*log_std)) * noise);
            }
        }
    }

    fn update(&mut self, batch: Transitions<'_>, average: &mut dyn FnMut(&mut [f32])) -> Losses {
        let Self { settings, networks, gradients, critic_work, actor_work, init, .. } = self;
        self.num_updates += 1;
        let num_updates = self.num_updates;
        let temperature = libm::expf(self.log_temperature[0]);
        let [critic_noise, actor_noise] =
            [0, 1].map(|branch| init.noise_rng(2 * num_updates + branch));
        let [first, second, actor_gradient, losses] = gradients.parts_mut();
        let ((critic_loss, values), (actor_loss, log_density)) = rayon::join(
            || {
                let gradients = [first, second];
                networks.critic_gradients(batch, temperature, critic_noise, critic_work, gradients)
            },
            || networks.actor_gradient(batch, temperature, actor_noise, actor_work, actor_gradient),
        );
        let value = 0.5 * values[0] + 0.5 * values[1];
        let target = critic_work.targets.iter().sum::<f32>() * batch.share();
        let [one, other] = values;
        losses.copy_from_slice(&[critic_loss, actor_loss, value, log_density, one, other, target]);
        average(&mut gradients.numbers);

        let [first, second, actor_gradient, losses] = gradients.parts_mut();
        let Networks { actor, critics, targets } = networks;
        rayon::join(
            || {
                let critics = critics.iter_mut().zip(targets).zip([first, second]);
                for ((critic, target), gradient) in critics {
                    critic.step(num_updates, 1.0, gradient);
                    target.follow(&critic.network, settings.target_fraction);
                }
            },
            || actor.step(num_updates, 1.0, actor_gradient),
        );
        if let Some(target_entropy) = settings.target_entropy {
            let slope = -(losses[3] + target_entropy * batch.num_actions() as f32);
            self.temperature_adam.step(num_updates, 1.0, &mut self.log_temperature, &[slope]);
        }
        Losses::new(losses[0], losses[1], losses[2])
    }

    fn diagnostics(&self) -> Vec<(&'static str, f32)> {
        let ([first, second, actor, _], means) = self.gradients.norms();
        vec![
            ("critic_1_value", means[4]),
            ("critic_2_value", means[5]),
            ("target", means[6]),
            ("temperature", libm::expf(self.log_temperature[0])),
            ("entropy", -means[3]),
            ("critic_1_gradient_norm", first),
            ("critic_2_gradient_norm", second),
            ("actor_gradient_norm", actor),
        ]
    }

    fn greedy_layers(&self) -> Vec<LayerWeights> {
        let mut layers = self.networks.actor.network.layer_weights();
        if let Some(LayerWeights { weights, biases, .. }) = layers.last_mut() {
            let num_actions = biases.len() / 2;
            let means = weights.chunks_exact(biases.len()).flat_map(|row| &row[..num_actions]);
            *weights = means.copied().collect();
            biases.truncate(num_actions);
        }
        layers
    }

    /// Sets the means of the actions. Their standard deviations begin as in every run.
    fn set_greedy_layers(&mut self, layers: &[LayerWeights]) -> bool {
        self.networks.actor.network.set_layer_weights(layers);
        true
    }

    fn state_mut(&mut self) -> StateMut<'_> {
        let Networks { actor, critics: [first, second], targets } = &mut self.networks;
        let [first_target, second_target] = targets;
        let mut state = StateMut { num_updates: &mut self.num_updates, vectors: Vec::new() };
        state.push("actor", actor.vectors_mut());
        state.push("critic_1", first.vectors_mut());
        state.push("critic_2", second.vectors_mut());
        state.push("target_1", first_target.vectors_mut());
        state.push("target_2", second_target.vectors_mut());
        state.push("temperature", [("logarithm", &mut self.log_temperature)]);
        state.push("temperature", self.temperature_adam.vectors_mut());
        state
    }
}

impl Networks {
    /// Computes the gradients of the critics' losses: their mean squared errors against the reward
    /// and the discounted soft value of the next state. Returns the sum of the losses and the mean
    /// value of each critic.
    fn critic_gradients(
        &self,
        batch: Transitions<'_>,
        temperature: f32,
        mut rng: impl Rng,
        work: &mut Work,
        gradients: [&mut [f32]; 2],
    ) -> (f32, [f32; 2]) {
        let inputs = batch.next_input;
        let Work { actor, critics: [first, second], sample, targets } = work;
        let outputs = actor.run(&self.actor.network, batch.next_actor_input);
        sample.draw(outputs, batch.num_actions(), &mut rng);
        let first_values = first.run_joined(&self.targets[0], inputs, &sample.actions);
        let second_values = second.run_joined(&self.targets[1], inputs, &sample.actions);
        let values = first_values.iter().zip(second_values).zip(&sample.log_densities);
        let values = values.map(|((first, second), log)| first.min(*second) - temperature * log);
        targets.clear();
        targets.extend(batch.targets(values));

        let [one, other] = gradients;
        let one = batch.regress(first, &self.critics[0].network, targets, one);
        let other = batch.regress(second, &self.critics[1].network, targets, other);
        (one[0] + other[0], [one[1], other[1]])
    }

    /// Computes the gradient of the actor's loss: the mean of the temperature times the logarithm
    /// of the density, minus the lower value. Returns the loss and the mean of the logarithms.
    fn actor_gradient(
        &self,
        batch: Transitions<'_>,
        temperature: f32,
        mut rng: impl Rng,
        work: &mut Work,
        gradient: &mut [f32],
    ) -> (f32, f32) {
        let (inputs, share, num_actions) = (batch.input, batch.share(), batch.num_actions());
        let Work { actor, critics: [first_pass, second_pass], sample, .. } = work;
        sample.draw(actor.run(&self.actor.network, batch.actor_input), num_actions, &mut rng);
        let [first, second] = self.critics.each_ref().map(|critic| &critic.network);
        let first_values = first_pass.run_joined(first, inputs, &sample.actions).to_vec();
        let second_values = second_pass.run_joined(second, inputs, &sample.actions).to_vec();
        let log_density = sample.log_densities.iter().sum::<f32>() * share;
        let pairs = first_values.iter().zip(&second_values);
        let values: f32 = pairs.map(|(first, second)| first.min(*second)).sum();
        let loss = temperature * log_density - share * values;

        let slope = |is_lower: bool| if is_lower { -share } else { 0.0 };
        let by_first = |row: usize, value| slope(value <= second_values[row]);
        let by_second = |row: usize, value| slope(value < first_values[row]);
        let by_first = first_pass.backward(first, by_first, None, num_actions);
        let by_second = second_pass.backward(second, by_second, None, num_actions);
        let by_output = |index, _| {
            let by_action = |index: usize| by_first[index] + by_second[index];
            sample.slope(index, by_action, temperature * share, num_actions)
        };
        actor.backward(&self.actor.network, by_output, Some(gradient), 0);
        (loss, log_density)
    }
}
