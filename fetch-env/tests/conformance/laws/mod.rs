//! The laws, generic over the simulator.

pub(crate) mod action;
pub(crate) mod check;
pub(crate) mod episode;
pub(crate) mod interface;
pub(crate) mod reset;
pub(crate) mod reward;
pub(crate) mod snapshot;
pub(crate) mod start;
pub(crate) mod variation;

use fetch_env::wrappers::Wrapped;
use fetch_env::{
    Env, EnvError, EnvId, FetchConfig, FetchEnv, FetchObservation, GoalObservation, Info, Step,
    TimeLimit,
};
use fetch_sim::{KinematicSimulator, SimConfig, SimError, Simulator};
use rand_pcg::Pcg64;
pub(crate) use testing::Result;

/// A kind of simulator to run the laws on.
pub(crate) trait Backend {
    type Sim: Simulator + std::fmt::Debug;

    /// The number of random steps that take about a second in a debug build.
    const STEPS: usize;
    /// Whether the object can be turned.
    const OBJECT_TURNS: bool;

    fn simulator(config: &SimConfig) -> Result<Self::Sim, SimError>;
}

/// The kinematic simulator.
pub(crate) struct Kinematic;

impl Backend for Kinematic {
    type Sim = KinematicSimulator;

    const STEPS: usize = 10_000;
    const OBJECT_TURNS: bool = false;

    fn simulator(config: &SimConfig) -> Result<KinematicSimulator, SimError> {
        Ok(KinematicSimulator::new(config))
    }
}

/// MuJoCo with the built-in model.
#[cfg(feature = "mujoco")]
pub(crate) struct Mujoco;

#[cfg(feature = "mujoco")]
impl Backend for Mujoco {
    type Sim = fetch_sim::MujocoSimulator;

    const STEPS: usize = 10_000;
    const OBJECT_TURNS: bool = true;

    fn simulator(config: &SimConfig) -> Result<Self::Sim, SimError> {
        use fetch_sim::{FetchModel, MujocoSimulator, Task};
        use std::sync::{Arc, OnceLock};

        // Settling takes longer than most laws.
        static MODELS: OnceLock<Vec<Arc<FetchModel>>> = OnceLock::new();
        let models = MODELS.get_or_init(|| {
            let settle = |task| FetchModel::load(&SimConfig::new(task)).expect("MuJoCo");
            Task::ALL.map(settle).into()
        });
        match models.iter().find(|model| model.config() == config) {
            Some(model) => MujocoSimulator::from_model(Arc::clone(model)),
            None => MujocoSimulator::new(config),
        }
    }
}

pub(crate) type TestEnv<B> = Wrapped<FetchEnv<<B as Backend>::Sim>, TimeLimit>;
pub(crate) type FetchStep = Step<FetchObservation, Info>;

/// Makes an environment with the reference's settings.
pub(crate) fn make<B: Backend>(id: EnvId) -> Result<TestEnv<B>, EnvError> {
    make_with_config::<B>(id.config())
}

pub(crate) fn make_with_config<B: Backend>(config: FetchConfig) -> Result<TestEnv<B>, EnvError> {
    let simulator = B::simulator(config.sim())?;
    Ok(FetchEnv::new(config, simulator)?.time_limited())
}

/// Takes `steps` random steps, with a reset at the end of each episode.
pub(crate) fn random_steps<B: Backend>(
    env: &mut TestEnv<B>,
    seed: u64,
    steps: usize,
) -> Result<Vec<FetchStep>, EnvError> {
    let mut rng = Pcg64::new(seed.into(), 0xac7);
    (0..steps)
        .map(|_| {
            let step = env.step(&env.action_space().sample(&mut rng))?;
            if step.is_last() {
                env.reset(None)?;
            }
            Ok(step)
        })
        .collect()
}

/// Returns all numbers of an observation as bits.
pub(crate) fn bits(observation: &FetchObservation) -> Vec<u64> {
    testing::bits([
        observation.observation(),
        observation.achieved_goal(),
        observation.desired_goal(),
    ])
}

/// Returns a trajectory as bits.
pub(crate) fn trajectory_bits(steps: &[FetchStep]) -> Vec<(Vec<u64>, u64, bool, bool, bool, u64)> {
    steps
        .iter()
        .map(|step| {
            let Info { is_success, distance, .. } = step.info;
            let observation = bits(&step.observation);
            let (reward, distance) = (step.reward.to_bits(), distance.to_bits());
            (observation, reward, step.terminated, step.truncated, is_success, distance)
        })
        .collect()
}
