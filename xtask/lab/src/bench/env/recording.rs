//! Recording the batches of a vector of environments in a hindsight replay buffer.

use std::sync::Arc;

use baselines::buffer_config;
use fetch_env::{
    FetchObservation,
    vec_env::{AutoresetMode, VecConfig, VecEnv, VecStep},
};
use her_relabel::HerBuffer;

use super::episodes::{Episodes, SEED, STEPS};
use crate::bench::interleaved::Contender;

/// The batches of an episode of one environment, which are recorded repeatedly.
pub struct Recording {
    batches: Vec<VecStep<FetchObservation>>,
    buffer: HerBuffer<f32>,
}

impl Recording {
    pub fn new(episodes: &Arc<Episodes>) -> anyhow::Result<Self> {
        let env = episodes.env()?;
        let buffer = HerBuffer::new(buffer_config(10 * STEPS, &env)?)?;
        let config = VecConfig::default().with_autoreset(AutoresetMode::Disabled);
        let mut envs = VecEnv::new([env], config)?;
        let mut batches = vec![envs.reset(Some(SEED))?.clone()];
        for action in episodes.actions(0) {
            batches.push(envs.step(action)?.clone());
        }
        Ok(Self { batches, buffer })
    }
}

impl Contender for Recording {
    fn work(&mut self) -> anyhow::Result<usize> {
        let mut recorded = 0;
        for batch in &self.batches {
            recorded += self.buffer.record(batch)?.recorded_steps;
        }
        Ok(recorded)
    }
}
