//! The algorithm that settings describe.

use super::ddpg::Ddpg;
use super::interface::{AlgorithmInit, Built};
use super::ppo::Ppo;
use super::sac::Sac;
use crate::learn::error::TrainError;
use crate::learn::settings::algorithm::AlgorithmSettings;

impl AlgorithmSettings {
    /// Builds the algorithm.
    ///
    /// # Errors
    /// Those of [`Ddpg::new`], [`Sac::new`] and [`Ppo::new`], and [`TrainError::Setting`] for
    /// [`Other`](Self::Other).
    pub fn build(&self, init: AlgorithmInit) -> Built {
        Ok(match self.clone() {
            Self::Ddpg(settings) => Box::new(Ddpg::new(settings, init)?),
            Self::Sac(settings) => Box::new(Sac::new(settings, init)?),
            Self::Ppo(settings) => Box::new(Ppo::new(settings, init)?),
            Self::Other(settings) => {
                return Err(TrainError::Setting {
                    name: "algorithm",
                    value: settings.to_string(),
                    expected: "pass its builder to Trainer::with_algorithm or \
                     resume_with_algorithm",
                });
            }
        })
    }
}
