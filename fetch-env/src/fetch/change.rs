//! Changes of an environment after it was made: its settings, its random numbers, and the goal of
//! its episode.

use fetch_sim::Simulator;
use goal_reward::DistanceReward;

use super::observation::Goal;
use super::task::{FetchTask, draw_goal};
use super::{config::FetchConfig, env::FetchEnv, error::MakeError, reset::FetchResetOptions};
use crate::gym::{env::goal::MovingGoal, error::EnvError};

impl<S: Simulator, R: From<DistanceReward>, T: FetchTask<S>> FetchEnv<S, R, T> {
    /// Replaces the settings. The reward's apply from now on, to the episode under way as well, and
    /// those of what is drawn from the next reset on; a [time limit](Self::time_limited) that was
    /// added stays as it is.
    ///
    /// ```
    /// use fetch_env::{Env, GoalEnvExt, make_kinematic};
    ///
    /// let mut env = make_kinematic("FetchReach-v4")?.into_inner();
    /// let stricter = env.config().clone().with_distance_threshold(0.01)?;
    /// env.set_config(stricter)?;
    /// assert_eq!(env.compute_reward(&[0.0; 3], &[0.0, 0.0, 0.02])?, -1.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`MakeError::SimulatorMismatch`] if the settings of the [simulator](FetchConfig::sim) are
    /// others, and [`MakeError::Variation`]; then nothing has changed.
    pub fn set_config(&mut self, config: FetchConfig) -> Result<(), MakeError> {
        if config.sim() != self.config.sim() {
            let reason = "it was made with another task, model or number of substeps".into();
            return Err(MakeError::SimulatorMismatch { reason });
        }
        config.variation().check_built_in(&self.simulator)?;
        self.reward = config.distance_reward().into();
        self.config = config;
        Ok(())
    }

    /// Draws a goal from the environment's random numbers, in meters, as a reset of a built-in task
    /// does. The episode keeps its own goal, and the next reset continues with the numbers after these.
    ///
    /// ```
    /// use fetch_env::{Env, GoalObservation, make_kinematic};
    ///
    /// let mut env = make_kinematic("FetchReach-v4")?.into_inner();
    /// env.reset(Some(0))?;
    /// let mut other = env.clone();
    /// let goal = env.sample_goal()?;
    /// assert_eq!(other.reset(None)?.observation.desired_goal(), goal);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`EnvError::ResetNeeded`] before the first reset.
    pub fn sample_goal(&mut self) -> Result<[f64; 3], EnvError> {
        let random = self.random.as_mut().ok_or(EnvError::ResetNeeded)?;
        Ok(draw_goal(&self.config, &self.simulator.settled(), random))
    }
}

impl<S: Simulator, R, T: FetchTask<S>> MovingGoal for FetchEnv<S, R, T> {
    fn set_desired_goal(&mut self, desired_goal: &[f64]) -> Result<(), EnvError> {
        let options = FetchResetOptions::default().with_desired_goal(desired_goal);
        options.check(self.config.task(), self.lengths.goal)?;
        *self.goal.as_mut().ok_or(EnvError::ResetNeeded)? = Goal::from_slice(desired_goal);
        Ok(())
    }
}
