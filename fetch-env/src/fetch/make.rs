//! Environments on MuJoCo, single or vectorized.

use std::{
    panic,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    thread,
};

use fetch_sim::{FetchModel, MujocoSimulator, SimConfig, SimError, Task, check_memory};
use goal_reward::DistanceReward;

use super::{config::FetchConfig, env::FetchEnv, env_id::EnvId, error::MakeError};
use crate::gym::env::{Env, observation::BatchObservation};
use crate::gym::registry::Registry;
use crate::gym::vec_env::error::VecEnvError;
use crate::gym::vec_env::{
    config::{VecConfig, check_num_envs},
    env::VecEnv,
    pool::STACK_SIZE,
};
use crate::gym::wrappers::{TimeLimit, Wrapped};
use crate::shared::Shared;

/// An environment as [`make`] makes it, or one with your own reward and task.
pub type MujocoEnv<R = DistanceReward, T = Task> =
    Wrapped<FetchEnv<MujocoSimulator, R, T>, TimeLimit>;

/// Creates an environment on MuJoCo, as Gymnasium's `make` does.
///
/// `config` is a name or an [`EnvId`], for the reference's settings and the built-in model, or a
/// [`FetchConfig`].
///
/// ```
/// use fetch_env::{Env, FetchConfig, RewardKind, Task, make};
///
/// let mut env = make("FetchPush-v4")?;
/// let start = env.reset(Some(0))?;
/// let step = env.step(&[1.0, 0.0, 0.0, 0.0])?;
/// assert!(step.info.distance > 0.0);
/// let far = make(FetchConfig::new(Task::Push, RewardKind::Sparse).with_target_range(0.3)?)?;
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
///
/// Living environments of this process with equal [`FetchConfig::sim`] share one model, which the
/// first of them compiles and lets settle. A `fork` waits while another thread compiles a model, and
/// a child that was forked meanwhile makes environments as its parent does.
///
/// The calling thread needs a stack of 256 KiB: MuJoCo compiles the model on it, and a smaller
/// stack may end the process. (Measured: 96 KiB are enough, with the built-in model and with the
/// reference's.) Rust's default is 2 MiB.
///
/// # Errors
/// [`MakeError::UnknownId`], which lists the nearest names, if no environment has this name;
/// [`MakeError::Sim`] if MuJoCo cannot be used.
pub fn make(
    config: impl TryInto<FetchConfig, Error: Into<MakeError>>,
) -> Result<MujocoEnv, MakeError> {
    Ok(FetchEnv::on_mujoco(config)?.time_limited())
}

impl FetchEnv<MujocoSimulator> {
    /// Creates an environment on MuJoCo as [`make`] does, but without a time limit, so that you can
    /// give it your own reward and task.
    ///
    /// # Errors
    /// As [`make`].
    pub fn on_mujoco(
        config: impl TryInto<FetchConfig, Error: Into<MakeError>>,
    ) -> Result<Self, MakeError> {
        let config = config.try_into().map_err(Into::into)?;
        let model = shared_model(config.sim())?;
        Self::new(config, MujocoSimulator::from_model(model)?)
    }
}

/// Creates `num_envs` environments that are stepped together; see [`vec_env`](crate::vec_env).
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
/// As [`make`], and [`MakeError::Vec`] if `num_envs` is 0 or exceeds 65,536, if there would be more
/// than 1,024 threads, or if one cannot be started.
pub fn make_vec(
    config: impl TryInto<FetchConfig, Error: Into<MakeError>>,
    num_envs: usize,
    vec_config: VecConfig,
) -> Result<VecEnv<MujocoEnv>, MakeError> {
    make_vec_while(config, num_envs, vec_config, make, || true)
}

/// Creates environments as [`make_vec`] does, each with `make`, while `goes_on` returns true. It is
/// asked on the calling thread, before each environment that this thread makes: tens of thousands take
/// seconds.
///
/// # Errors
/// As [`make_vec`], and [`MakeError::Stopped`] once `goes_on` has returned false.
pub fn make_vec_while<E>(
    config: impl TryInto<FetchConfig, Error: Into<MakeError>>,
    num_envs: usize,
    vec_config: VecConfig,
    make: impl Fn(FetchConfig) -> Result<E, MakeError> + Sync,
    mut goes_on: impl FnMut() -> bool,
) -> Result<VecEnv<E>, MakeError>
where
    E: Env<Observation: BatchObservation> + Send + 'static,
{
    check_num_envs(num_envs)?;
    // As threads make them, as a vector gets them, and as it keeps them.
    check_memory(3 * num_envs * size_of::<E>(), "the environments")?;
    let config = &config.try_into().map_err(Into::into)?;
    let threads = vec_config.threads_for(num_envs)?;
    // Keeps the model alive until every environment shares it.
    let _model = shared_model(config.sim())?;
    let is_stopped = &AtomicBool::new(false);
    let make_next = &|| {
        if is_stopped.load(Relaxed) { Err(MakeError::Stopped) } else { make(config.clone()) }
    };
    let count = |part: usize| (part + 1) * num_envs / threads - part * num_envs / threads;
    // Most of the time goes into memory, which each thread allocates for its own environments.
    let envs = thread::scope(|scope| {
        let part = |index: usize| {
            let make_part = move || (0..count(index)).map(|_| make_next()).collect();
            thread::Builder::new()
                .stack_size(STACK_SIZE)
                .spawn_scoped(scope, make_part)
                .map_err(|error| VecEnvError::Thread { reason: error.to_string() })
        };
        let parts: Vec<_> = (1..threads).map(part).collect();
        let mut envs = Vec::with_capacity(num_envs);
        for _ in 0..count(0) {
            is_stopped.fetch_or(!goes_on(), Relaxed);
            // The other threads stop as well.
            envs.push(make_next().inspect_err(|_| is_stopped.store(true, Relaxed))?);
        }
        for part in parts {
            let made: Result<Vec<_>, MakeError> =
                part?.join().unwrap_or_else(|payload| panic::resume_unwind(payload));
            envs.extend(made?);
        }
        Ok::<_, MakeError>(envs)
    })?;
    Ok(VecEnv::new(envs, vec_config)?)
}

impl Registry<MujocoEnv> {
    /// Creates a registry of the eight Fetch environments, made by [`make`].
    #[must_use]
    pub fn fetch() -> Self {
        Self::of(EnvId::ALL, |id| Ok(make(id)?))
    }
}

/// Returns the model of a configuration, compiled and settled once for all living environments.
/// They can share it because a model never changes.
fn shared_model(config: &SimConfig) -> Result<Arc<FetchModel>, SimError> {
    static MODELS: Shared<FetchModel> = Shared::new();
    MODELS.get_or_make(|model| model.config() == config, || FetchModel::load(config))
}
