use std::{panic, thread};

use crate::{
    EnvError, EnvId, FetchConfig, MujocoEnv, VecEnv,
    fetch::shared_model::shared_model,
    make_config,
    vec_env::{VecConfig, VecEnvError},
};

/// Makes `num_envs` environments that are stepped together, by their name; see
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
/// As [`make`](crate::make), and [`EnvError::Vec`] if `num_envs` is 0 or threads cannot be started.
pub fn make_vec(
    id: &str,
    num_envs: usize,
    vec_config: VecConfig,
) -> Result<VecEnv<MujocoEnv>, EnvError> {
    make_vec_config(&id.parse::<EnvId>()?.config(), num_envs, vec_config)
}

/// Makes `num_envs` environments that are stepped together, from a configuration of one's own.
///
/// # Errors
/// As [`make_vec`].
pub fn make_vec_config(
    config: &FetchConfig,
    num_envs: usize,
    vec_config: VecConfig,
) -> Result<VecEnv<MujocoEnv>, EnvError> {
    if num_envs == 0 {
        return Err(VecEnvError::NoEnvs.into());
    }
    let threads = vec_config.num_threads(num_envs);
    // Kept until all have it.
    let _model = shared_model(config.sim())?;
    // Memory is what takes the time, and each thread fetches its own.
    let envs = thread::scope(|scope| {
        let part = |index: usize| {
            let count = (index + 1) * num_envs / threads - index * num_envs / threads;
            let make = move || (0..count).map(|_| make_config(config.clone())).collect();
            thread::Builder::new().spawn_scoped(scope, make).map_err(VecEnvError::from_spawn)
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
