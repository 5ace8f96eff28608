//! What every contender plays: the same episodes with the same random actions.

use std::sync::Arc;

use baselines::{Policy, RandomPolicy};
use fetch_env::{Env, FetchConfig, FetchEnv, FetchObservation, MujocoEnv};
use fetch_sim::{FetchModel, MujocoSimulator};

/// Steps of an episode.
pub const STEPS: usize = 50;
/// Episodes that are played over and over.
const EPISODES: usize = 20;
/// Seed of the resets and, from another generator, of the actions.
pub const SEED: u64 = 0;

/// Episodes of one task on one model.
pub struct Episodes {
    pub config: FetchConfig,
    pub model: Arc<FetchModel>,
    /// `qpos` after each episode's reset.
    starts: Vec<Vec<f64>>,
    actions: Vec<[f32; 4]>,
}

impl Episodes {
    pub fn new(config: FetchConfig) -> anyhow::Result<Arc<Self>> {
        let model = FetchModel::load(&config.sim()?)?;
        let actions = random_actions(EPISODES * STEPS)?;
        let mut episodes = Self { config, model, starts: Vec::new(), actions };
        let mut env = episodes.env()?;
        for episode in 0..EPISODES {
            env.reset(episodes.seed(episode))?;
            episodes.starts.push(env.inner().simulator().data().qpos().to_vec());
        }
        Ok(Arc::new(episodes))
    }

    /// An environment on the shared model.
    pub fn env(&self) -> anyhow::Result<MujocoEnv> {
        let simulator = MujocoSimulator::with_model(Arc::clone(&self.model))?;
        Ok(FetchEnv::new(self.config.clone(), simulator)?.time_limited())
    }

    /// The seed with which an episode begins: the others go on from the first.
    pub fn seed(&self, episode: usize) -> Option<u64> {
        episode.is_multiple_of(EPISODES).then_some(SEED)
    }

    pub fn start(&self, episode: usize) -> &[f64] {
        &self.starts[episode % EPISODES]
    }

    pub fn actions(&self, episode: usize) -> &[[f32; 4]] {
        &self.actions[(episode % EPISODES) * STEPS..][..STEPS]
    }
}

/// Uniform over the action space.
pub fn random_actions(count: usize) -> anyhow::Result<Vec<[f32; 4]>> {
    let mut policy = RandomPolicy::new(SEED);
    let mut env = fetch_env::make_kinematic("FetchReach-v4")?;
    // A policy is asked with an observation, which this one does not look at.
    let observation: FetchObservation = env.reset(Some(SEED))?.observation;
    Ok((0..count).map(|_| policy.act(&observation)).collect())
}
