//! Environments on the kinematic simulator, single or vectorized.

use fetch_sim::{KinematicSimulator, Task, check_memory};
use goal_reward::DistanceReward;

use super::{config::FetchConfig, env::FetchEnv, env_id::EnvId, error::MakeError};
use crate::gym::vec_env::config::{VecConfig, check_num_envs};
use crate::gym::{
    registry::Registry,
    vec_env::env::VecEnv,
    wrappers::{TimeLimit, Wrapped},
};

/// An environment as [`make_kinematic`] makes it, or one with your own reward and task.
pub type KinematicEnv<R = DistanceReward, T = Task> =
    Wrapped<FetchEnv<KinematicSimulator, R, T>, TimeLimit>;

/// Creates an environment as `make` does on MuJoCo, but on the
/// [kinematic simulator](KinematicSimulator), to test code that uses environments on machines without
/// MuJoCo.
///
/// # Errors
/// [`MakeError::UnknownId`], which lists the nearest names, if no environment has this name.
pub fn make_kinematic(
    config: impl TryInto<FetchConfig, Error: Into<MakeError>>,
) -> Result<KinematicEnv, MakeError> {
    let config = config.try_into().map_err(Into::into)?;
    let simulator = KinematicSimulator::new(config.sim());
    Ok(FetchEnv::new(config, simulator)?.time_limited())
}

/// Creates `num_envs` environments as `make_vec` does on MuJoCo, but on the kinematic simulator.
///
/// ```
/// use fetch_env::{make_kinematic_vec, vec_env::VecConfig};
///
/// let mut envs = make_kinematic_vec("FetchReach-v4", 4, VecConfig::default())?;
/// envs.reset(Some(42))?;
/// let step = envs.step(&[0.0; 4 * 4])?;
/// assert_eq!(step.reward(), [-1.0; 4]);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
///
/// # Errors
/// As [`make_kinematic`], and [`MakeError::Vec`] if `num_envs` is 0 or exceeds 65,536, or if a
/// thread cannot be started.
pub fn make_kinematic_vec(
    config: impl TryInto<FetchConfig, Error: Into<MakeError>>,
    num_envs: usize,
    vec_config: VecConfig,
) -> Result<VecEnv<KinematicEnv>, MakeError> {
    check_num_envs(num_envs)?;
    // As a vector gets them, and as it keeps them.
    check_memory(2 * num_envs * size_of::<KinematicEnv>(), "the environments")?;
    let config = config.try_into().map_err(Into::into)?;
    let envs: Result<Vec<_>, _> = (0..num_envs).map(|_| make_kinematic(config.clone())).collect();
    Ok(VecEnv::new(envs?, vec_config)?)
}

impl Registry<KinematicEnv> {
    /// Creates a registry of the eight Fetch environments, made by [`make_kinematic`].
    #[must_use]
    pub fn kinematic() -> Self {
        Self::of(EnvId::ALL, |id| Ok(make_kinematic(id)?))
    }
}

#[cfg(test)]
mod tests {
    use allocation_counter::measure;
    use fetch_sim::{SimConfig, SimError, Simulator};
    use goal_reward::RewardKind;

    use super::*;
    use crate::gym::vec_env::AutoresetMode;

    type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

    /// Counts the allocations of the caller and of all worker threads in `rounds` of steps,
    /// autoresets, sends and receives.
    fn allocations<S: Simulator + Send + 'static>(
        simulator: impl Fn(&SimConfig) -> Result<S, SimError>,
        rounds: usize,
    ) -> Result<[u64; 2]> {
        const NUM_ENVS: usize = 6;
        let config = FetchConfig::new(Task::Push, RewardKind::Sparse)
            .with_max_episode_steps(5)
            .expect("not zero");
        let mut single = Vec::new();
        for _ in 0..NUM_ENVS {
            let simulator = simulator(config.sim())?;
            single.push(FetchEnv::new(config.clone(), simulator)?.time_limited());
        }
        let vec_config =
            VecConfig::default().with_num_threads(3).with_autoreset(AutoresetMode::SameStep);
        let mut envs = VecEnv::new(single, vec_config)?;
        let counts = envs.count_allocations();
        envs.reset(Some(0))?;
        let actions = [0.1; 4 * NUM_ENVS];
        let mut ids = [0; 2];
        #[cfg(feature = "her-relabel")]
        let mut buffer = {
            let dims = her_relabel::Dims { observation: 25, goal: 3, action: 4 };
            let config = her_relabel::BufferConfig::new(60, dims).with_num_envs(NUM_ENVS);
            let mut buffer = her_relabel::HerBuffer::<f32>::new(config)?;
            buffer.record(envs.reset(Some(0))?)?.check()?;
            for _ in 0..100 {
                buffer.record(envs.step(&actions)?)?.check()?;
            }
            buffer
        };
        let caller = measure(|| {
            for _ in 0..20 * rounds {
                let step = envs.step(&actions).expect("a step");
                assert_eq!(step.errors().count(), 0);
                #[cfg(feature = "her-relabel")]
                buffer.record(step).expect("rows that fit").check().expect("numbers");
            }
            envs.send(&actions, &[0, 1, 2, 3, 4, 5]).expect("idle environments");
            for _ in 0..20 * rounds {
                ids.copy_from_slice(envs.recv(2).expect("results").env_index());
                envs.send(&actions[..8], &ids).expect("idle environments");
            }
            envs.recv(NUM_ENVS).expect("results");
        });
        drop(envs);
        let workers = counts.into_iter().map(|count| count.join().expect("no panic")).sum();
        Ok([caller.count_total, workers])
    }

    fn is_free_of_allocation<S: Simulator + Send + 'static>(
        simulator: impl Fn(&SimConfig) -> Result<S, SimError>,
    ) -> Result {
        // Comparing with a second round cancels whatever a thread allocates only once.
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
        is_free_of_allocation(fetch_sim::MujocoSimulator::new)
    }
}
