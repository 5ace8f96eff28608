//! Boxes of environments, references to them and environments of other crates.

use fetch_env::{
    BoxSpace, Env, EnvError, FetchObservation, FetchResetOptions, GoalEnv, Info, KinematicEnv,
    Reset, Space, Step, VecEnv,
    check::{CheckOptions, check_goal_env, check_goals},
    make_kinematic,
    vec_env::VecConfig,
};
use goal_reward::DistanceReward;
use testing::Result;

type DynGoalEnv = dyn GoalEnv<
        Observation = FetchObservation,
        Info = Info,
        ActionSpace = BoxSpace<f32>,
        ResetOptions = FetchResetOptions,
        GoalReward = DistanceReward,
    > + Send;

#[test]
fn a_boxed_environment_keeps_every_law() {
    let make = || Ok(Box::new(make_kinematic("FetchPush-v4")?));
    let options = CheckOptions::default();
    let report = check_goal_env(make, &options);
    assert!(report.passed(), "{report}");
}

#[test]
fn environments_of_different_types_are_stepped_together() -> Result {
    let plain = |id| -> Result<Box<DynGoalEnv>> { Ok(Box::new(make_kinematic(id)?)) };
    let wrapped = |id| -> Result<Box<DynGoalEnv>> { Ok(Box::new(Unplugged(make_kinematic(id)?))) };
    let report = check_goals(
        || Ok::<Box<DynGoalEnv>, EnvError>(Box::new(make_kinematic("FetchReach-v4")?)),
        &CheckOptions::default(),
    );
    assert!(report.passed(), "{report}");

    let envs = [plain("FetchReach-v4")?, wrapped("FetchReach-v4")?];
    let mut envs = VecEnv::new(envs, VecConfig::default())?;
    envs.reset(Some(0))?;
    let batch = envs.step(&[0.0; 2 * 4])?;
    assert_eq!(batch.error(0), None);
    assert_eq!(batch.error(1), Some(&EnvError::other("it is unplugged: plug it in")));
    assert_ne!(batch.error(1), Some(&EnvError::other("it is broken")));
    assert_eq!(batch.truncated(), [false, true], "the failure ends the episode");
    Ok(())
}

#[test]
fn a_reference_steps_the_environment_it_refers_to() -> Result {
    fn step_once(mut env: impl Env<ActionSpace = BoxSpace<f32>>) -> Result<f64> {
        env.reset(Some(7))?;
        Ok(env.step(&[1.0, 0.0, 0.0, 0.0])?.reward)
    }
    let mut env = make_kinematic("FetchReachDense-v4")?;
    let reward = step_once(&mut env)?;
    assert_eq!(env.elapsed_steps(), 1);
    assert_eq!(reward, step_once(make_kinematic("FetchReachDense-v4")?)?);
    Ok(())
}

/// An environment whose steps fail with an error that this crate does not know.
#[derive(Debug)]
struct Unplugged(KinematicEnv);

impl Env for Unplugged {
    type Observation = FetchObservation;
    type Info = Info;
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = FetchResetOptions;

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &FetchResetOptions,
    ) -> std::result::Result<Reset<FetchObservation, Info>, EnvError> {
        self.0.reset_with(seed, options)
    }

    fn step(
        &mut self,
        _action: &[f32],
    ) -> std::result::Result<Step<FetchObservation, Info>, EnvError> {
        Err(EnvError::other("it is unplugged: plug it in"))
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        self.0.action_space()
    }

    fn observation_space(&self) -> &Space {
        self.0.observation_space()
    }
}

impl GoalEnv for Unplugged {
    type GoalReward = DistanceReward;

    fn goal_reward(&self) -> &DistanceReward {
        self.0.goal_reward()
    }
}
