use std::{fmt, str::FromStr};

use fetch_sim::{KinematicSimulator, Task};
use goal_reward::RewardKind;
use serde::{Deserialize, Serialize};

#[cfg(feature = "mujoco")]
use super::shared_model::shared_model;
use crate::{EnvError, FetchConfig, FetchEnv, TimeLimit};

/// The name of one of the eight environments, such as `FetchPush-v4` or `FetchPushDense-v4`.
///
/// Written, parsed and serialized as Gymnasium spells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct EnvId {
    /// The task.
    pub task: Task,
    /// The kind of reward.
    pub reward: RewardKind,
}

impl EnvId {
    /// All environments, task by task, the sparse reward first.
    pub const ALL: [Self; 8] = {
        let mut all = [Self { task: Task::Reach, reward: RewardKind::Sparse }; 8];
        let mut i = 0;
        while i < all.len() {
            all[i].task = Task::ALL[i / 2];
            if i % 2 == 1 {
                all[i].reward = RewardKind::Dense;
            }
            i += 1;
        }
        all
    };

    /// The reference's configuration of the environment.
    #[must_use]
    pub fn config(self) -> FetchConfig {
        FetchConfig::new(self.task, self.reward)
    }
}

impl fmt::Display for EnvId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let suffix = match self.reward {
            RewardKind::Sparse => "",
            RewardKind::Dense => "Dense",
        };
        // Through `pad`, so that tables can align it.
        f.pad(&format!("Fetch{}{suffix}-v4", self.task))
    }
}

impl FromStr for EnvId {
    type Err = UnknownEnvId;

    fn from_str(id: &str) -> Result<Self, UnknownEnvId> {
        Self::ALL
            .into_iter()
            .find(|known| known.to_string() == id)
            .ok_or_else(|| UnknownEnvId::new(id))
    }
}

impl TryFrom<String> for EnvId {
    type Error = UnknownEnvId;

    fn try_from(id: String) -> Result<Self, UnknownEnvId> {
        id.parse()
    }
}

impl From<EnvId> for String {
    fn from(id: EnvId) -> Self {
        id.to_string()
    }
}

/// There is no environment of this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no environment {id:?}; the nearest are {}, {} and {}", nearest[0], nearest[1], nearest[2])]
#[non_exhaustive]
pub struct UnknownEnvId {
    /// The name.
    pub id: String,
    /// The environments with the most similar names, the nearest first.
    pub nearest: [EnvId; 3],
}

impl UnknownEnvId {
    fn new(id: &str) -> Self {
        let lowercase = id.to_lowercase();
        let mut known = EnvId::ALL;
        known.sort_by_cached_key(|known| {
            strsim::damerau_levenshtein(&lowercase, &known.to_string().to_lowercase())
        });
        Self { id: id.to_owned(), nearest: [known[0], known[1], known[2]] }
    }
}

/// What [`make`] makes.
#[cfg(feature = "mujoco")]
pub type MujocoEnv = TimeLimit<FetchEnv<fetch_sim::MujocoSimulator>>;

/// What [`make_kinematic`] makes.
pub type KinematicEnv = TimeLimit<FetchEnv<KinematicSimulator>>;

/// Makes an environment by its name, as Gymnasium's `make` does: on MuJoCo, with the built-in model
/// and 50 steps an episode.
///
/// ```
/// use fetch_env::{Env, make};
///
/// let mut env = make("FetchPush-v4")?;
/// let start = env.reset(Some(0))?;
/// let step = env.step(&[1.0, 0.0, 0.0, 0.0])?;
/// assert!(step.info.distance > 0.0);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
///
/// # Errors
/// [`EnvError::UnknownId`] with the nearest names if there is none of this one;
/// [`EnvError::Sim`] if MuJoCo cannot be used.
#[cfg(feature = "mujoco")]
pub fn make(id: &str) -> Result<MujocoEnv, EnvError> {
    make_config(id.parse::<EnvId>()?.config())
}

/// Makes an environment on MuJoCo from a configuration of one's own.
///
/// The environments of this process that are alive share one model for each
/// [`FetchConfig::sim`]; it is compiled, and let settle, for the first of them.
///
/// # Errors
/// [`EnvError::Sim`] if MuJoCo cannot be used.
#[cfg(feature = "mujoco")]
pub fn make_config(config: FetchConfig) -> Result<MujocoEnv, EnvError> {
    let model = shared_model(config.sim())?;
    let simulator = fetch_sim::MujocoSimulator::with_model(model)?;
    Ok(FetchEnv::new(config, simulator)?.time_limited())
}

/// Makes an environment by its name on the [stand-in](KinematicSimulator) for the physics, to test
/// what is built upon environments where there is no MuJoCo.
///
/// # Errors
/// [`EnvError::UnknownId`] with the nearest names if there is none of this one.
pub fn make_kinematic(id: &str) -> Result<KinematicEnv, EnvError> {
    let config = id.parse::<EnvId>()?.config();
    let simulator = KinematicSimulator::new(config.sim());
    Ok(FetchEnv::new(config, simulator)?.time_limited())
}
