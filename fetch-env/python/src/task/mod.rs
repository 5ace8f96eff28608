//! Environments whose task is that of the settings, or a Python object.

mod own;
mod sim;
mod together;

use std::{ops::RangeInclusive, sync::Arc};

use baselines::runs::MakeEnvs;
use fetch_env::variation::{Factor, InterfaceFactor};
use fetch_env::{
    EnvError, FetchConfig, FetchEnv, FetchTask, GoalEnv, GoalReward, MakeError, ModelSource,
    MujocoSimulator, NpRandom, Simulator, Task,
    wrappers::{TimeLimit, Wrapped},
};
use goal_reward::{DistanceReward, GoalError, GoalPairs, Symmetry};
use pyo3::prelude::*;

use crate::error::{Error, Result};

pub(crate) use self::{own::OwnTask, sim::Sim, together::complete};

/// An environment without a time limit, and one with it.
pub(crate) type Simulated = FetchEnv<MujocoSimulator, AnyReward, AnyTask>;
pub(crate) type Limited = Wrapped<Simulated, TimeLimit>;

/// A task in Python, and whether its methods are called once for many environments: an environment
/// then returns zeros in place of their results, which [`complete`] replaces.
#[derive(Clone)]
pub(crate) struct Own {
    pub(crate) task: Arc<OwnTask>,
    pub(crate) is_together: bool,
    /// The reward of the settings, for a task that has none.
    pub(crate) settings: DistanceReward,
}

impl Own {
    /// Returns the symmetries that the task describes.
    fn symmetries(&self, env: &Simulated) -> Vec<Symmetry> {
        let (Some(mirror), Ok(robot)) = (&self.task.mirror, env.robot_symmetries()) else {
            return Vec::new();
        };
        let center = env.simulator().settled().gripper_position;
        mirror.symmetries(&robot, center).unwrap_or_default()
    }

    /// Raises an error if the task cannot have this factor in an episode: what its methods return for
    /// many environments at once is neither late nor noisy.
    pub(crate) fn check(&self, factor: &Factor) -> Result<()> {
        if !self.is_together || !is_of_observations(factor) {
            return Ok(());
        }
        Err(Error::value(format!(
            "{factor}: pass variation={{\"{factor}\": 0.0}} to the vector, so that its task in Python \
             is called for each environment alone"
        )))
    }
}

/// Creates an environment.
pub(crate) fn make(config: FetchConfig, own: Option<&Own>) -> Result<Simulated, MakeError> {
    let env = FetchEnv::on_mujoco(config)?;
    let reward = env.config().distance_reward().into();
    let task = AnyTask::BuiltIn(env.config().task());
    match own {
        None => {
            let symmetries = env.symmetries();
            let env = env.with_goal_reward(reward).with_task(task);
            env.map(|env| env.with_symmetries(symmetries))
        }
        Some(own) => {
            let reward = AnyReward::Own(own.clone());
            let env = env.with_goal_reward(reward).with_task(AnyTask::Own(own.clone()))?;
            let symmetries = own.symmetries(&env);
            Ok(env.with_symmetries(symmetries))
        }
    }
}

/// Makes the environments of runs: of the task in Python, if there is one.
#[derive(Clone, Default)]
pub(crate) struct AnyTasks(Option<(Arc<OwnTask>, Option<ModelSource>)>);

impl AnyTasks {
    /// Makes environments with a task in Python and its model, or with the built-in tasks.
    pub(crate) const fn new(task: Option<(Arc<OwnTask>, Option<ModelSource>)>) -> Self {
        Self(task)
    }

    /// Makes environments with a task in Python, in the model that it extends, or that of the settings.
    pub(crate) fn of_task(task: &Bound<'_, PyAny>) -> Result<Self> {
        let extension = OwnTask::extension(task)?.map(ModelSource::Extended);
        Ok(Self(Some((Arc::new(OwnTask::new(task)?), extension))))
    }

    /// Raises the exception of a reward, if there was one since the last call.
    pub(crate) fn check(&self) -> Result<()> {
        self.0.as_ref().map_or(Ok(()), |(task, _)| task.check())
    }
}

impl MakeEnvs for AnyTasks {
    type Env = Limited;

    fn task(&self) -> Option<&str> {
        self.0.as_ref().map(|(task, _)| task.name())
    }

    fn make(&self, config: FetchConfig) -> Result<Limited, MakeError> {
        let env = match &self.0 {
            None => make(config, None),
            Some((task, model)) => {
                let (task, settings) = (Arc::clone(task), config.distance_reward());
                let own = Own { task, is_together: false, settings };
                let model = model.clone().unwrap_or_else(|| config.sim().model().clone());
                make(config.with_model(model), Some(&own))
            }
        };
        Ok(env?.time_limited())
    }
}

/// Whether a factor makes observations late or noisy.
pub(crate) fn is_of_observations(factor: &Factor) -> bool {
    use InterfaceFactor::{ActionDelay, ActionLowPass, ActionNoise, ActionScale};
    let Factor::Interface(factor) = factor else { return false };
    !matches!(factor, ActionLowPass | ActionScale | ActionNoise | ActionDelay)
}

/// The reward of the settings, or of a task in Python.
#[derive(Clone)]
pub(crate) enum AnyReward {
    Settings(DistanceReward),
    Own(Own),
}

impl From<DistanceReward> for AnyReward {
    fn from(reward: DistanceReward) -> Self {
        Self::Settings(reward)
    }
}

impl AnyReward {
    /// Raises the exception of a task in Python, if there was one since the last call.
    pub(crate) fn check(&self) -> Result<()> {
        match self {
            Self::Settings(_) => Ok(()),
            Self::Own(own) => own.task.check(),
        }
    }
}

impl GoalReward for AnyReward {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        let mut reward = [f64::NAN];
        match (self, GoalPairs::new(achieved_goal, desired_goal, achieved_goal.len())) {
            (Self::Settings(reward), _) => return reward.reward(achieved_goal, desired_goal),
            (Self::Own(own), Ok(pair)) if !own.is_together => {
                own.reward_batch(pair, &mut reward);
            }
            _ => {}
        }
        reward[0]
    }

    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        let mut success = [false];
        match (self, GoalPairs::new(achieved_goal, desired_goal, achieved_goal.len())) {
            (Self::Settings(reward), _) => return reward.is_success(achieved_goal, desired_goal),
            (Self::Own(own), Ok(pair)) if !own.is_together => {
                own.is_success_batch(pair, &mut success);
            }
            _ => {}
        }
        success[0]
    }

    fn bounds(&self) -> RangeInclusive<f64> {
        match self {
            Self::Settings(reward) => reward.bounds(),
            Self::Own(own) => own.bounds(),
        }
    }

    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        match self {
            Self::Settings(reward) => reward.reward_batch(pairs, out)?,
            Self::Own(own) => {
                check_output(pairs, out.len())?;
                own.reward_batch(pairs, out);
            }
        }
        Ok(())
    }

    fn is_success_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        match self {
            Self::Settings(reward) => reward.is_success_batch(pairs, out)?,
            Self::Own(own) => {
                check_output(pairs, out.len())?;
                own.is_success_batch(pairs, out);
            }
        }
        Ok(())
    }
}

/// Checks the length of what is written for pairs of goals.
pub(crate) fn check_output(pairs: GoalPairs<'_>, actual: usize) -> Result<(), GoalError> {
    let expected = pairs.len();
    if actual == expected { Ok(()) } else { Err(GoalError::OutputLength { expected, actual }) }
}

/// A built-in task, or one in Python.
#[derive(Clone)]
pub(crate) enum AnyTask {
    BuiltIn(Task),
    Own(Own),
}

impl FetchTask<MujocoSimulator> for AnyTask {
    type Memory = ();

    fn goal_len(&self) -> usize {
        match self {
            Self::BuiltIn(task) => FetchTask::<MujocoSimulator>::goal_len(task),
            Self::Own(own) => own.task.goal_len,
        }
    }

    fn extra_len(&self) -> usize {
        match self {
            Self::BuiltIn(_) => 0,
            Self::Own(own) => own.task.extra_len,
        }
    }

    fn begin_episode(
        &self,
        config: &FetchConfig,
        simulator: &mut MujocoSimulator,
        random: &mut NpRandom,
        goal: &mut [f64],
    ) -> Result<(), EnvError> {
        match self {
            Self::BuiltIn(task) => task.begin_episode(config, simulator, random, goal),
            Self::Own(own) => own.task.begin_episode(simulator, random, goal),
        }
    }

    fn achieved_goal(
        &self,
        simulator: &MujocoSimulator,
        memory: &(),
        goal: &mut [f64],
    ) -> Result<(), EnvError> {
        match self {
            Self::BuiltIn(task) => task.achieved_goal(simulator, memory, goal),
            Self::Own(own) if own.is_together => Ok(()),
            Self::Own(own) => own.task.achieved_goal(simulator, goal),
        }
    }

    fn observe_extra(
        &self,
        simulator: &MujocoSimulator,
        _: &(),
        extra: &mut [f64],
    ) -> Result<(), EnvError> {
        match self {
            Self::Own(own) if !own.is_together => own.task.observe_extra(simulator, extra),
            _ => Ok(()),
        }
    }
}
