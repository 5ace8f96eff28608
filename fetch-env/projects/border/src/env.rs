//! A Fetch environment as border-core's `Env`.

use anyhow::Result;
use border_core::{Act, Env, Info, Obs, Step, record::Record};
use fetch_env::{Env as _, FetchObservation, KinematicEnv, make_kinematic};

/// An observation of one environment.
#[derive(Clone, Debug)]
pub struct FetchObs(pub FetchObservation);

impl Obs for FetchObs {
    fn len(&self) -> usize {
        1
    }
}

/// An action for one environment.
#[derive(Clone, Debug)]
pub struct FetchAct(pub Vec<f32>);

impl Act for FetchAct {
    fn len(&self) -> usize {
        1
    }
}

/// Whether the step achieved the goal.
#[derive(Clone, Copy, Debug)]
pub struct Success(pub bool);

impl Info for Success {}

/// The name of an environment, such as `FetchPush-v4`.
#[derive(Clone, Debug)]
pub struct Config(pub String);

/// The environment. With MuJoCo, use `MujocoEnv` and `make` for `KinematicEnv` and
/// `make_kinematic`.
#[derive(Debug)]
pub struct GoalEnvironment {
    env: KinematicEnv,
    /// The seed of the first reset; later ones continue its random numbers.
    seed: Option<u64>,
}

impl Env for GoalEnvironment {
    type Config = Config;
    type Obs = FetchObs;
    type Act = FetchAct;
    type Info = Success;

    fn build(config: &Config, seed: i64) -> Result<Self> {
        Ok(Self { env: make_kinematic(&config.0)?, seed: Some(seed.cast_unsigned()) })
    }

    fn reset(&mut self, _is_done: Option<&Vec<i8>>) -> Result<FetchObs> {
        Ok(FetchObs(self.env.reset(self.seed.take())?.observation))
    }

    /// Starts the episode with this seed, as border's evaluators expect.
    fn reset_with_index(&mut self, index: usize) -> Result<FetchObs> {
        Ok(FetchObs(self.env.reset(Some(index as u64))?.observation))
    }

    /// # Panics
    /// If the environment fails: border has no error for it.
    fn step(&mut self, action: &FetchAct) -> (Step<Self>, Record) {
        let step = self.env.step(&action.0).unwrap_or_else(|error| panic!("{error}"));
        let record = Record::from_scalar("success", f32::from(step.info.is_success));
        let step = Step {
            act: action.clone(),
            obs: FetchObs(step.observation),
            reward: vec![step.reward as f32],
            is_terminated: vec![i8::from(step.terminated)],
            is_truncated: vec![i8::from(step.truncated)],
            info: Success(step.info.is_success),
            init_obs: None,
        };
        (step, record)
    }
}
