//! The preset of the book whose second chapter this project's commands follow.

use fetch_env::Task;

use super::algorithm_settings::SacSettings;
use super::settings::{AlgorithmSettings, TrainSettings};

impl TrainSettings {
    /// Returns the settings of [`fast`](Self::fast), with SAC and what the book that the chapter is
    /// from found best for it on Push: gamma 0.95 and a fixed temperature of 0.05.
    ///
    /// Source: the book's chapter on sparse rewards, a comparison of 24 settings. Its other numbers
    /// are those of Stable-Baselines3, which learn much later: learning rate 0.0003, target fraction
    /// 0.005, batches of 256, an update for each step of eight environments, inputs that are not
    /// normalized.
    #[must_use]
    pub fn book(task: Task) -> Self {
        Self { algorithm: AlgorithmSettings::Sac(SacSettings::book()), ..Self::fast(task) }
    }
}

impl SacSettings {
    /// Returns the settings with the temperature that the book fixes, and critics that are not
    /// normalized, as its are not.
    #[must_use]
    pub fn book() -> Self {
        Self {
            layer_norm: false,
            initial_temperature: 0.05,
            target_entropy: None,
            ..Self::default()
        }
    }
}
