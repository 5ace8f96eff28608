//! The settings of the algorithms.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::range::ranged_settings;

/// An algorithm and its settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum AlgorithmSettings {
    /// [`Ddpg`](crate::learn::Ddpg).
    Ddpg(DdpgSettings),
    /// [`Sac`](crate::learn::Sac).
    Sac(SacSettings),
    /// Your own algorithm, which [`Trainer::with_algorithm`](crate::learn::Trainer::with_algorithm)
    /// builds: its settings, which checkpoints and policies record, nested at most 100 deep.
    Other(Value),
}

impl AlgorithmSettings {
    /// Returns the name of the variant: `ddpg`, `sac` or `other`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Ddpg(_) => "ddpg",
            Self::Sac(_) => "sac",
            Self::Other(_) => "other",
        }
    }
}

ranged_settings! {
    /// Settings of [`Ddpg`](crate::learn::Ddpg).
    ///
    /// The sources are the authors of Fetch (Plappert et al., *Multi-goal reinforcement learning*,
    /// 2018, and `her/experiment/config.py` of openai/baselines) and this project's own
    /// measurements. The defaults are those of the preset `fast` for PickAndPlace.
    pub struct DdpgSettings {
        /// The lengths of the hidden layers of actor and critic: 256, 256. The authors: 256, 256,
        /// 256.
        pub hidden: Vec<usize> => 1..=1_024 in at most 4 layers,
        /// Whether the critic's hidden layers are normalized: false, the authors'; measured, Push
        /// learns later with it, and updates take a quarter longer. For Slide, and in MRL (Pitis et
        /// al., 2020): true.
        pub layer_norm: bool,
        /// The factor of the actor's last weights at the start: 0.1, measured, because an actor
        /// that starts saturated never learns. The authors: 1.
        pub last_layer_scale: f32 => 0.0..=10.0,
        /// The learning rate of the actor: 0.002, measured. The authors, and for Reach and Slide:
        /// 0.001.
        pub actor_learning_rate: f32 => 1e-9..=1.0,
        /// The learning rate of the critic: 0.002, measured. The authors, and for Reach and Slide:
        /// 0.001.
        pub critic_learning_rate: f32 => 1e-9..=1.0,
        /// The number of updates before the learning rates begin to fall: 0, and 100,000 for Slide.
        pub halving_start: u64 => 0..=1_000_000_000,
        /// The number of updates after which the learning rates have halved; each update lowers them
        /// by the same factor. `None`, the authors', for rates that never fall, and 60,000 for
        /// Slide.
        pub halving_interval: Option<u64> => 1..=1_000_000_000,
        /// The discount of a step: 0.95, measured. The authors, and for Slide: 0.98, which is 1 - 1
        /// / 50 steps.
        pub gamma: f64 => 0.0..=1.0,
        /// The fraction of the way that target networks move towards the learning ones: 0.05, the
        /// authors'.
        pub target_fraction: f32 => 1e-6..=1.0,
        /// The number of updates between two such moves: 1, measured. The authors: 40.
        pub target_interval: u64 => 1..=1_000_000,
        /// The fraction of the way that the actor that is evaluated moves towards the learning one
        /// after every update: 0.005, measured, because single updates make single states better
        /// and others worse; 1 for Reach, 0.001 for Push, and 0.0003 for Slide, where success rates
        /// vary by 0.1 with 0.005. The authors: 1, which is the learning actor.
        pub average_fraction: f32 => 1e-6..=1.0,
        /// The weight of the mean square of the actions in the actor's loss: 0.05, measured, 0.5
        /// for Reach, and 0.01 for Slide, as in MRL (Pitis et al., 2020). The authors: 1.
        pub action_l2: f32 => 0.0..=1_000.0,
        /// Whether targets are clipped to the values that discounted sums of rewards within their
        /// [bounds](goal_reward::GoalReward::bounds) can have: true, the authors', whose rewards of
        /// -1 and 0 give `[-1 / (1 - gamma), 0]`. An infinite bound clips nothing.
        pub clip_targets: bool,
        /// The weight of the value of the actor's actions in its loss: 1, the authors'; 0 for an
        /// actor that only imitates.
        pub value_weight: f32 => 0.0..=1_000.0,
        /// The weight of imitating [demonstrations](crate::learn::Trainer::add_demonstrations) in the
        /// actor's loss: 0. The term is the mean square of the differences between the actor's
        /// actions and those of demonstrated transitions, over the batch; other transitions add
        /// nothing to it. Learning from demonstrations alone needs it, because the critic overrates
        /// actions that it has never seen: measured, 100 for rewards of -1 and 0, and 10 with an
        /// `advantage_factor` of 5. Sources: Nair et al., *Overcoming exploration in reinforcement
        /// learning with demonstrations*, 2018, and Fujimoto and Gu, *A minimalist approach to
        /// offline reinforcement learning*, 2021.
        pub imitation_weight: f32 => 0.0..=1_000.0,
        /// How much more strongly better actions are imitated: 0, not at all. Each square of the
        /// imitation is multiplied by the exponential function of this number times the advantage
        /// of the demonstrated action over the actor's, as the critic estimates it, but by 10 at
        /// most. Without a value in the loss, 0 is goal-conditioned behavior cloning (Ghosh et al.,
        /// *Learning to reach goals via iterated supervised learning*, 2021), and 1 the advantage
        /// weight of Yang et al., *Rethinking goal-conditioned supervised learning and its
        /// connection to offline RL*, 2022. Measured on noisy episodes of a trained policy: 1
        /// without a value, 5 with one.
        pub advantage_factor: f32 => 0.0..=1_000.0,
        /// The standard deviation of the exploration noise: 0.2, the authors'; 0.1 for Slide, as in
        /// MRL.
        pub noise: f32 => 0.0..=10.0,
    }
}

impl Default for DdpgSettings {
    fn default() -> Self {
        Self {
            hidden: vec![256, 256],
            layer_norm: false,
            last_layer_scale: 0.1,
            actor_learning_rate: 0.002,
            critic_learning_rate: 0.002,
            halving_start: 0,
            halving_interval: None,
            gamma: 0.95,
            target_fraction: 0.05,
            target_interval: 1,
            average_fraction: 0.005,
            action_l2: 0.05,
            clip_targets: true,
            value_weight: 1.0,
            imitation_weight: 0.0,
            advantage_factor: 0.0,
            noise: 0.2,
        }
    }
}

impl DdpgSettings {
    /// Returns the factor of the learning rates in update `number`.
    pub(crate) fn rate_factor(&self, number: u64) -> f32 {
        let falling = number.saturating_sub(self.halving_start) as f32;
        self.halving_interval.map_or(1.0, |interval| libm::exp2f(-falling / interval as f32))
    }

    /// Returns the authors' settings.
    #[must_use]
    pub fn authors() -> Self {
        Self {
            hidden: vec![256; 3],
            last_layer_scale: 1.0,
            actor_learning_rate: 0.001,
            critic_learning_rate: 0.001,
            gamma: 0.98,
            target_interval: 40,
            average_fraction: 1.0,
            action_l2: 1.0,
            ..Self::default()
        }
    }
}

ranged_settings! {
    /// Settings of [`Sac`](crate::learn::Sac).
    ///
    /// The sources are Haarnoja et al., *Soft actor-critic algorithms and applications*, 2018 (the
    /// authors below), the Fetch settings of RL Baselines3 Zoo, and this project's own
    /// measurements.
    pub struct SacSettings {
        /// The lengths of the hidden layers of actor and critics: 256, 256, the authors'.
        pub hidden: Vec<usize> => 1..=1_024 in at most 4 layers,
        /// Whether the critics' hidden layers are normalized: true, as in MRL (Pitis et al., 2020).
        pub layer_norm: bool,
        /// The factor of the actor's last weights at the start: 0.1, as in
        /// [`DdpgSettings`].
        pub last_layer_scale: f32 => 0.0..=10.0,
        /// The learning rate of actor, critics and temperature: 0.001, the zoo's. The authors:
        /// 0.0003.
        pub learning_rate: f32 => 1e-9..=1.0,
        /// The discount of a step: 0.95, the zoo's. The authors: 0.99.
        pub gamma: f64 => 0.0..=1.0,
        /// The fraction of the way that target networks move towards the learning ones after every
        /// update: 0.05, the zoo's. The authors: 0.005.
        pub target_fraction: f32 => 1e-6..=1.0,
        /// The temperature at the start, the weight of the entropy: 0.1. Stable-Baselines3: 1.
        pub initial_temperature: f32 => 1e-6..=1_000.0,
        /// The entropy that the temperature aims at, for each element of an action: -1, the
        /// authors'. `None` for a temperature that stays at its initial value.
        pub target_entropy: Option<f32> => -100.0..=0.69,
    }
}

impl Default for SacSettings {
    fn default() -> Self {
        Self {
            hidden: vec![256, 256],
            layer_norm: true,
            last_layer_scale: 0.1,
            learning_rate: 0.001,
            gamma: 0.95,
            target_fraction: 0.05,
            initial_temperature: 0.1,
            target_entropy: Some(-1.0),
        }
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
