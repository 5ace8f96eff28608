//! The settings of the algorithms.

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;

use super::range::ranged_settings;
use crate::learn::error::TrainError;

/// An algorithm and its settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum AlgorithmSettings {
    /// [`Ddpg`](crate::learn::Ddpg).
    Ddpg(DdpgSettings),
    /// [`Sac`](crate::learn::Sac).
    Sac(SacSettings),
    /// [`Ppo`](crate::learn::Ppo).
    Ppo(PpoSettings),
    /// Your own algorithm, which [`Trainer::with_algorithm`](crate::learn::Trainer::with_algorithm)
    /// builds: its settings, which checkpoints and policies record, nested at most 100 deep.
    Other(Value),
}

impl AlgorithmSettings {
    /// Returns the settings of your own algorithm as [`Other`](Self::Other).
    ///
    /// # Errors
    /// [`TrainError::Algorithm`] if they can not be serialized.
    pub fn other(settings: &impl Serialize) -> Result<Self, TrainError> {
        let value = serde_json::to_value(settings);
        value.map(Self::Other).map_err(|error| TrainError::Algorithm(error.into()))
    }

    /// Returns the settings of your own algorithm, to build it.
    ///
    /// # Errors
    /// [`TrainError::Algorithm`] if these are the settings of another.
    pub fn read_other<S: DeserializeOwned>(&self) -> Result<S, TrainError> {
        let Self::Other(value) = self else {
            let error = format!("its settings are those of {}", self.name());
            return Err(TrainError::Algorithm(error.into()));
        };
        S::deserialize(value).map_err(|error| TrainError::Algorithm(error.into()))
    }

    /// Returns the name of the variant: `ddpg`, `sac`, `ppo` or `other`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Ddpg(_) => "ddpg",
            Self::Sac(_) => "sac",
            Self::Ppo(_) => "ppo",
            Self::Other(_) => "other",
        }
    }
}

ranged_settings! {
    /// Settings of [`Ddpg`](crate::learn::Ddpg). [`TrainSettings`](crate::learn::TrainSettings) has a
    /// table of what the presets choose.
    ///
    /// The sources are the authors of Fetch (Plappert et al., *Multi-goal reinforcement learning*,
    /// 2018, and `her/experiment/config.py` of openai/baselines), MRL (Pitis et al., 2020) and this
    /// project's own measurements. The defaults are those of the preset `fast` for PickAndPlace.
    pub struct DdpgSettings {
        /// The lengths of the hidden layers of actor and critic.
        pub hidden: Vec<usize> = vec![256, 256] => 1..=1_024 in at most 4 layers,
        /// Whether the critic's hidden layers are normalized, as in MRL. Slide ends better with it;
        /// Push learns later, and updates take a quarter longer.
        pub layer_norm: bool = false,
        /// The factor of the actor's last weights at the start. A small one keeps the actor from
        /// starting saturated, from where it never learns.
        pub last_layer_scale: f32 = 0.1 => 0.0..=10.0,
        /// The learning rate of the actor.
        pub actor_learning_rate: f32 = 0.002 => 1e-9..=1.0,
        /// The learning rate of the critic.
        pub critic_learning_rate: f32 = 0.002 => 1e-9..=1.0,
        /// The number of updates before the learning rates begin to fall.
        pub halving_start: u64 = 0 => 0..=1_000_000_000,
        /// The number of updates after which the learning rates have halved; each update lowers them
        /// by the same factor. `None` for rates that never fall.
        pub halving_interval: Option<u64> = None => 1..=1_000_000_000,
        /// The discount of a step.
        pub gamma: f64 = 0.95 => 0.0..=1.0,
        /// The fraction of the way that target networks move towards the learning ones.
        pub target_fraction: f32 = 0.05 => 1e-6..=1.0,
        /// The number of updates between two such moves.
        pub target_interval: u64 = 1 => 1..=1_000_000,
        /// The fraction of the way that the actor that is evaluated moves towards the learning one
        /// after every update. With 1 it is the learning actor, whose single updates make single
        /// states better and others worse.
        pub average_fraction: f32 = 0.005 => 1e-6..=1.0,
        /// The weight of the mean square of the actions in the actor's loss.
        pub action_l2: f32 = 0.05 => 0.0..=1_000.0,
        /// Whether targets are clipped to the values that discounted sums of rewards within their
        /// [bounds](goal_reward::GoalReward::bounds) can have: `[-1 / (1 - gamma), 0]` for rewards
        /// of -1 and 0. An infinite bound clips nothing.
        pub clip_targets: bool = true,
        /// The weight of the value of the actor's actions in its loss: 0 for an actor that only
        /// imitates.
        pub value_weight: f32 = 1.0 => 0.0..=1_000.0,
        /// The weight of imitating [demonstrations](crate::learn::Trainer::add_demonstrations) in
        /// the actor's loss. The term is the mean square of the differences between the actor's
        /// actions and those of demonstrated transitions, over the batch; other transitions add
        /// nothing to it.
        ///
        /// Learning from demonstrations alone needs it, because the critic overrates actions that it
        /// has never seen: try 100 for rewards of -1 and 0, and 10 with an `advantage_factor` of 5.
        /// Sources: Nair et al., *Overcoming exploration in reinforcement learning with
        /// demonstrations*, 2018, and Fujimoto and Gu, *A minimalist approach to offline
        /// reinforcement learning*, 2021.
        pub imitation_weight: f32 = 0.0 => 0.0..=1_000.0,
        /// How much more strongly better actions are imitated; with 0, all are imitated alike. Each
        /// square of the imitation is multiplied by the exponential function of this number times
        /// the advantage of the demonstrated action over the actor's, as the critic estimates it,
        /// but by 10 at most.
        ///
        /// Without a value in the loss, 0 is goal-conditioned behavior cloning (Ghosh et al.,
        /// *Learning to reach goals via iterated supervised learning*, 2021), and 1 the advantage
        /// weight of Yang et al., *Rethinking goal-conditioned supervised learning and its
        /// connection to offline RL*, 2022. On noisy episodes of a trained policy, 1 is best without
        /// a value, and 5 with one.
        pub advantage_factor: f32 = 0.0 => 0.0..=1_000.0,
        /// The standard deviation of the exploration noise.
        pub noise: f32 = 0.2 => 0.0..=10.0,
    }
}

impl DdpgSettings {
    /// Returns the factor of the learning rates in update `number`.
    pub(crate) fn rate_factor(&self, number: u64) -> f32 {
        let falling = number.saturating_sub(self.halving_start) as f32;
        self.halving_interval.map_or(1.0, |interval| libm::exp2f(-falling / interval as f32))
    }
}

ranged_settings! {
    /// Settings of [`Sac`](crate::learn::Sac).
    ///
    /// The sources are Haarnoja et al., *Soft actor-critic algorithms and applications*, 2018, whose
    /// temperature aims at the same entropy, and RL Baselines3 Zoo, whose learning rate, discount
    /// and target fraction for Fetch are the defaults.
    pub struct SacSettings {
        /// The lengths of the hidden layers of actor and critics.
        pub hidden: Vec<usize> = vec![256, 256] => 1..=1_024 in at most 4 layers,
        /// Whether the critics' hidden layers are normalized, as in MRL (Pitis et al., 2020).
        pub layer_norm: bool = true,
        /// The factor of the actor's last weights at the start, as in [`DdpgSettings`].
        pub last_layer_scale: f32 = 0.1 => 0.0..=10.0,
        /// The learning rate of actor, critics and temperature.
        pub learning_rate: f32 = 0.001 => 1e-9..=1.0,
        /// The discount of a step.
        pub gamma: f64 = 0.95 => 0.0..=1.0,
        /// The fraction of the way that target networks move towards the learning ones after every
        /// update.
        pub target_fraction: f32 = 0.05 => 1e-6..=1.0,
        /// The temperature at the start, the weight of the entropy.
        pub initial_temperature: f32 = 0.1 => 1e-6..=1_000.0,
        /// The entropy that the temperature aims at, for each element of an action. `None` for a
        /// temperature that stays at its initial value.
        pub target_entropy: Option<f32> = Some(-1.0) => -100.0..=0.69,
    }
}

ranged_settings! {
    /// Settings of [`Ppo`](crate::learn::Ppo). An update learns from the
    /// [`steps_per_cycle`](crate::learn::ScheduleSettings::steps_per_cycle) steps of each environment.
    ///
    /// The defaults are those of Stable-Baselines3 for 8 environments of 1,024 steps, where batches
    /// have 256 steps.
    pub struct PpoSettings {
        /// The lengths of the hidden layers of actor and critic.
        pub hidden: Vec<usize> = vec![64, 64] => 1..=1_024 in at most 4 layers,
        /// The factor of the actor's last weights at the start. With a small one, all actions are
        /// close to 0 at first, but for their noise.
        pub last_layer_scale: f32 = 0.01 => 0.0..=10.0,
        /// The standard deviation of the actions at the start, before the hyperbolic tangent. It is
        /// learned, one number for each element of an action.
        pub initial_std: f32 = 1.0 => 1e-3..=10.0,
        /// The learning rate of actor and critic.
        pub learning_rate: f32 = 0.0003 => 1e-9..=1.0,
        /// The discount of a step.
        pub gamma: f64 = 0.99 => 0.0..=1.0,
        /// The weight of later errors in the [advantages](crate::learn::Rollout::advantages) of
        /// earlier steps.
        pub gae_lambda: f32 = 0.95 => 0.0..=1.0,
        /// How often an update goes through its steps.
        pub epochs: usize = 10 => 1..=1_000,
        /// The number of batches into which each time divides the steps. Each is a step of the
        /// optimizer.
        pub minibatches: usize = 32 => 1..=1_000,
        /// How much more or less probable than before an action can become before its gradient
        /// stops.
        pub clip_range: f32 = 0.2 => 1e-3..=10.0,
        /// The weight of the entropy of the actions in the loss.
        pub entropy_weight: f32 = 0.0 => 0.0..=1_000.0,
        /// The weight of the critic's loss, which matters for the norm of the gradient alone.
        pub value_weight: f32 = 0.5 => 0.0..=1_000.0,
        /// The norm to which the gradient of all parameters together is shortened.
        pub max_gradient_norm: f32 = 0.5 => 1e-6..=1e6,
        /// The divergence from the actor before the update, times 1.5, above which a batch ends the
        /// update; `None` for no end before the last epoch.
        pub target_kl: Option<f32> = None => 1e-6..=100.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_fall_by_half_in_each_interval_after_the_start() {
        let settings = DdpgSettings { halving_start: 100, ..DdpgSettings::default() };
        assert_eq!(settings.rate_factor(1_000_000), 1.0);
        let settings = DdpgSettings { halving_interval: Some(50), ..settings };
        let factors = [1, 100, 150, 200].map(|number| settings.rate_factor(number));
        assert_eq!(factors, [1.0, 1.0, 0.5, 0.25]);
    }
}
