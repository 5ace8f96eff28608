//! The episodes that every contender plays, with the same random actions.

use std::sync::Arc;

use fetch_env::{Env, FetchConfig, FetchEnv, MujocoEnv, NpRandom};
use fetch_sim::{FetchModel, MujocoSimulator};

/// Steps of an episode.
pub const STEPS: usize = 50;
/// Number of episodes, which are played repeatedly.
pub const EPISODES: usize = 20;
/// Seed of the resets and, in another generator, of the actions.
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
        let model = FetchModel::load(config.sim())?;
        let actions = random_actions(EPISODES * STEPS);
        let mut episodes = Self { config, model, starts: Vec::new(), actions };
        let mut env = episodes.env()?;
        for episode in 0..EPISODES {
            env.reset(episodes.seed(episode))?;
            episodes.starts.push(env.inner().simulator().data().qpos().to_vec());
        }
        Ok(Arc::new(episodes))
    }

    /// Returns an environment on the shared model.
    pub fn env(&self) -> anyhow::Result<MujocoEnv> {
        let simulator = MujocoSimulator::from_model(Arc::clone(&self.model))?;
        Ok(FetchEnv::new(self.config.clone(), simulator)?.time_limited())
    }

    /// Returns the seed of an episode's reset: only the first reset has one, the others continue
    /// its stream.
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

/// Draws uniform actions, the same as the peers' scripts draw with numpy.
pub fn random_actions(count: usize) -> Vec<[f32; 4]> {
    let mut random = NpRandom::new(SEED);
    (0..count).map(|_| [(); 4].map(|()| random.uniform(-1.0, 1.0) as f32)).collect()
}
