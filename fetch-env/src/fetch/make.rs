//! Environments made by name or from settings, alone or many at once.

use fetch_sim::KinematicSimulator;
#[cfg(feature = "mujoco")]
use {
    super::config::FetchConfig,
    crate::{
        error::VecEnvError,
        vec_env::{config::VecConfig, env::VecEnv},
    },
    fetch_sim::{FetchModel, MujocoSimulator, SimConfig, SimError},
    std::{
        panic,
        sync::{Arc, Mutex, PoisonError, Weak},
        thread,
    },
};

use super::env::FetchEnv;
use crate::env::time_limit::TimeLimit;
use crate::env_id::EnvId;
use crate::error::EnvError;

/// The environments that [`make_kinematic`] makes.
pub type KinematicEnv = TimeLimit<FetchEnv<KinematicSimulator>>;

/// The environments that [`make`] makes.
#[cfg(feature = "mujoco")]
pub type MujocoEnv = TimeLimit<FetchEnv<MujocoSimulator>>;

/// Makes the environment of this name on the [stand-in](KinematicSimulator) for the physics, to
/// test code that uses environments on machines without MuJoCo.
///
/// # Errors
/// [`EnvError::UnknownId`], which lists the nearest names, if no environment has this name.
pub fn make_kinematic(id: &str) -> Result<KinematicEnv, EnvError> {
    let config = id.parse::<EnvId>()?.config();
    let simulator = KinematicSimulator::new(&config.sim()?);
    Ok(FetchEnv::new(config, simulator)?.time_limited())
}

/// Makes the environment of this name, as Gymnasium's `make` does: on MuJoCo, with the built-in
/// model and 50 steps per episode.
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
/// [`EnvError::UnknownId`], which lists the nearest names, if no environment has this name;
/// [`EnvError::Sim`] if MuJoCo cannot be used.
#[cfg(feature = "mujoco")]
pub fn make(id: &str) -> Result<MujocoEnv, EnvError> {
    make_with_config(id.parse::<EnvId>()?.config())
}

/// Makes an environment on MuJoCo with the given settings.
///
/// Living environments of this process with equal [`FetchConfig::sim`] share one model, which the
/// first of them compiles and lets settle.
///
/// # Errors
/// [`EnvError::Config`] for invalid settings; [`EnvError::Sim`] if MuJoCo cannot be used.
#[cfg(feature = "mujoco")]
pub fn make_with_config(config: FetchConfig) -> Result<MujocoEnv, EnvError> {
    let model = shared_model(&config.sim()?)?;
    Ok(FetchEnv::new(config, MujocoSimulator::from_model(model)?)?.time_limited())
}

/// Makes `num_envs` environments of this name that are stepped together; see
/// [`vec_env`](crate::vec_env).
///
/// ```
/// use fetch_env::{make_vec, vec_env::VecConfig};
///
/// let mut envs = make_vec("FetchReach-v4", 4, VecConfig::default())?;
/// envs.reset(Some(42))?;
/// let batch = envs.step(&[0.0; 4 * 4])?;
/// assert_eq!(batch.reward(), [-1.0; 4]);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
///
/// # Errors
/// As [`make`], and [`EnvError::Vec`] if `num_envs` is 0 or a thread cannot be started.
#[cfg(feature = "mujoco")]
pub fn make_vec(
    id: &str,
    num_envs: usize,
    vec_config: VecConfig,
) -> Result<VecEnv<MujocoEnv>, EnvError> {
    make_vec_with_config(&id.parse::<EnvId>()?.config(), num_envs, vec_config)
}

/// Makes `num_envs` environments with the given settings that are stepped together.
///
/// # Errors
/// As [`make_with_config`], and [`EnvError::Vec`] if `num_envs` is 0 or a thread cannot be started.
#[cfg(feature = "mujoco")]
pub fn make_vec_with_config(
    config: &FetchConfig,
    num_envs: usize,
    vec_config: VecConfig,
) -> Result<VecEnv<MujocoEnv>, EnvError> {
    if num_envs == 0 {
        return Err(VecEnvError::NoEnvs.into());
    }
    let threads = vec_config.threads_for(num_envs);
    // Stays alive until every environment shares it.
    let _model = shared_model(&config.sim()?)?;
    // Most of the time goes into memory, which each thread allocates for its own environments.
    let envs = thread::scope(|scope| {
        let part = |index: usize| {
            let count = (index + 1) * num_envs / threads - index * num_envs / threads;
            let make = move || (0..count).map(|_| make_with_config(config.clone())).collect();
            thread::Builder::new()
                .spawn_scoped(scope, make)
                .map_err(|error| VecEnvError::Thread { reason: error.to_string() })
        };
        let parts: Vec<_> = (0..threads).map(part).collect();
        let mut envs = Vec::with_capacity(num_envs);
        for part in parts {
            let made: Result<Vec<_>, EnvError> =
                part?.join().unwrap_or_else(|payload| panic::resume_unwind(payload));
            envs.extend(made?);
        }
        Ok::<_, EnvError>(envs)
    })?;
    Ok(VecEnv::new(envs, vec_config)?)
}

/// The models of the living environments of this process.
#[cfg(feature = "mujoco")]
static MODELS: Mutex<Vec<Weak<FetchModel>>> = Mutex::new(Vec::new());

/// Returns the model of a configuration, compiled and settled once for all living environments.
/// They can share it because a model never changes.
#[cfg(feature = "mujoco")]
fn shared_model(config: &SimConfig) -> Result<Arc<FetchModel>, SimError> {
    // A panic while the lock is held leaves a valid list.
    let mut models = MODELS.lock().unwrap_or_else(PoisonError::into_inner);
    models.retain(|model| model.strong_count() > 0);
    let mut alive = models.iter().filter_map(Weak::upgrade);
    if let Some(model) = alive.find(|model| model.config() == config) {
        return Ok(model);
    }
    drop(alive);
    let model = FetchModel::load(config)?;
    models.push(Arc::downgrade(&model));
    Ok(model)
}

#[cfg(test)]
mod tests {
    use allocation_counter::measure;
    use fetch_sim::{SimConfig, SimError, Simulator, Task};
    use goal_reward::RewardKind;

    use super::*;
    use crate::fetch::config::FetchConfig;
    use crate::vec_env::{AutoresetMode, VecConfig, VecEnv};

    type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

    /// Counts the allocations of the caller and of all worker threads in `rounds` of steps,
    /// autoresets, sends and receipts.
    fn allocations<S: Simulator + Send + 'static>(
        simulator: impl Fn(&SimConfig) -> Result<S, SimError>,
        rounds: usize,
    ) -> Result<[u64; 2]> {
        const NUM_ENVS: usize = 6;
        let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_max_episode_steps(5);
        let mut single = Vec::new();
        for _ in 0..NUM_ENVS {
            let simulator = simulator(&config.sim()?)?;
            single.push(FetchEnv::new(config.clone(), simulator)?.time_limited());
        }
        let vec_config =
            VecConfig::default().with_num_threads(3).with_autoreset(AutoresetMode::SameStep);
        let mut envs = VecEnv::new(single, vec_config)?;
        let counts = envs.count_allocations();
        envs.reset(Some(0))?;
        let actions = [0.1; 4 * NUM_ENVS];
        let mut ids = [0; 2];
        let caller = measure(|| {
            for _ in 0..20 * rounds {
                assert_eq!(envs.step(&actions).expect("a step").errors().count(), 0);
            }
            envs.send(&actions, &[0, 1, 2, 3, 4, 5]).expect("idle environments");
            for _ in 0..20 * rounds {
                ids.copy_from_slice(envs.recv(2).expect("a batch").env_ids());
                envs.send(&actions[..8], &ids).expect("idle environments");
            }
            envs.recv(NUM_ENVS).expect("a batch");
        });
        drop(envs);
        let workers = counts.into_iter().map(|count| count.join().expect("no panic")).sum();
        Ok([caller.count_total, workers])
    }

    fn is_free_of_allocation<S: Simulator + Send + 'static>(
        simulator: impl Fn(&SimConfig) -> Result<S, SimError>,
    ) -> Result {
        // A second round leaves out whatever a thread allocates once.
        let once = allocations(&simulator, 1)?;
        assert_eq!(once[0], 0);
        assert_eq!(allocations(&simulator, 2)?, once);
        Ok(())
    }

    #[test]
    fn many_environments_allocate_nothing() -> Result {
        is_free_of_allocation(|config| Ok(KinematicSimulator::new(config)))
    }

    #[cfg(feature = "mujoco")]
    #[test]
    fn many_environments_allocate_nothing_on_mujoco() -> Result {
        is_free_of_allocation(MujocoSimulator::new)
    }
}
