//! Tasks: their goals, and what they add to the observation.

use std::{borrow::Cow, fmt::Debug};

use fetch_sim::{Settled, Simulator, Task};
use serde::{Serialize, de::DeserializeOwned};

use super::config::{FetchConfig, MAX_TARGET_RISE};
use crate::gym::{error::EnvError, np_random::NpRandom};

/// The task of a [`FetchEnv`](super::env::FetchEnv): how goals are drawn, which one a state
/// achieves, and what is observed besides the robot and the object.
///
/// [`Task`] implements it for the built-in tasks. For a task of your own, implement it for a type
/// and pass a value to [`FetchEnv::with_task`](super::env::FetchEnv::with_task). The value itself
/// has no state: all that an episode changes is in the simulator, in the goal and in the
/// [memory](Self::Memory), so a snapshot contains all of it. State in a `Cell` or a `Mutex` of the
/// task would not be restored, and [`check_goal_env`](crate::check::check_goal_env) finds it.
///
/// ```
/// use fetch_env::{
///     EnvError, FetchConfig, FetchEnv, FetchTask, KinematicSimulator, NpRandom, RewardKind,
///     Simulator, Task,
/// };
///
/// /// Move the gripper to a point on a circle of 10 cm around its start.
/// #[derive(Clone, Debug)]
/// struct Circle;
///
/// impl<S: Simulator> FetchTask<S> for Circle {
///     type Memory = ();
///
///     fn goal_len(&self) -> usize {
///         3
///     }
///
///     fn begin_episode(
///         &self,
///         _config: &FetchConfig,
///         simulator: &mut S,
///         random: &mut NpRandom,
///         desired_goal: &mut [f64],
///     ) -> Result<(), EnvError> {
///         let start = simulator.settled().gripper_position;
///         let angle = random.uniform(0.0, std::f64::consts::TAU);
///         desired_goal.copy_from_slice(&[
///             start.x + 0.1 * angle.cos(),
///             start.y + 0.1 * angle.sin(),
///             start.z,
///         ]);
///         Ok(())
///     }
///
///     fn achieved_goal(&self, simulator: &S, _: &(), goal: &mut [f64]) -> Result<(), EnvError> {
///         goal.copy_from_slice(simulator.gripper().position.as_slice());
///         Ok(())
///     }
/// }
///
/// let config = FetchConfig::new(Task::Reach, RewardKind::Sparse);
/// let simulator = KinematicSimulator::new(config.sim());
/// let env = FetchEnv::new(config, simulator)?.with_task(Circle)?.time_limited();
/// # let options = fetch_env::check::CheckOptions::default();
/// # assert!(fetch_env::check::check_goal_env(|| Ok(env.clone()), &options).passed());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait FetchTask<S: Simulator> {
    /// What the task remembers of the episode, such as which buttons have been touched; `()` if the
    /// simulator's state says all. The environment keeps it, and snapshots hold it. Rewards see of it
    /// what the achieved goal says, and policies what an observation says. Before the first reset it is
    /// the default.
    type Memory: Clone + Debug + Default + PartialEq + Serialize + DeserializeOwned;

    /// Returns the number of elements of a goal, at least 1. Environments ask once, when the task is
    /// set.
    fn goal_len(&self) -> usize;

    /// Returns the number of elements that [`observe_extra`](Self::observe_extra) writes: 0 by
    /// default. Environments ask once, when the task is set.
    fn extra_len(&self) -> usize {
        0
    }

    /// Begins an episode: places what the task has added to the scene, and draws the goal.
    ///
    /// The simulator has just been reset, with the object's start drawn as the
    /// [configuration](FetchConfig::object_range) says. Draw all random numbers from `random`,
    /// which the seed determines. The goal's elements must be numbers of at most
    /// [`LARGEST_NUMBER`](fetch_sim::LARGEST_NUMBER); the reset returns an error for others. Returns
    /// the memory with which the episode begins.
    ///
    /// # Errors
    /// Any [`EnvError`], which the reset then returns.
    fn begin_episode(
        &self,
        config: &FetchConfig,
        simulator: &mut S,
        random: &mut NpRandom,
        desired_goal: &mut [f64],
    ) -> Result<Self::Memory, EnvError>;

    /// Returns the names of this task's own factors, which a
    /// [`Variation`](crate::variation::Variation) may draw: none by default.
    fn factors(&self) -> &[&str] {
        &[]
    }

    /// Changes the scene and the goal after [`begin_episode`](Self::begin_episode), given the episode's
    /// number for each of the [factors](Self::factors), or `None` where it does not vary.
    ///
    /// # Errors
    /// Any [`EnvError`], which the reset then returns.
    fn vary(
        &self,
        simulator: &mut S,
        numbers: &[Option<f64>],
        desired_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        let _ = (simulator, numbers, desired_goal);
        Ok(())
    }

    /// Takes a new state into the memory: once at the end of each reset and of each step, before the
    /// goal and the observation of that state. By default it changes nothing.
    ///
    /// # Errors
    /// Any [`EnvError`], which the reset or the step then returns.
    fn remember(&self, simulator: &S, memory: &mut Self::Memory) -> Result<(), EnvError> {
        let _ = (simulator, memory);
        Ok(())
    }

    /// Writes the goal that the current state achieves.
    ///
    /// # Errors
    /// Any [`EnvError`], which the reset or the step then returns.
    fn achieved_goal(
        &self,
        simulator: &S,
        memory: &Self::Memory,
        achieved_goal: &mut [f64],
    ) -> Result<(), EnvError>;

    /// Writes the elements that follow those of
    /// [`FetchObservation`](super::observation::FetchObservation)'s table.
    ///
    /// # Errors
    /// Any [`EnvError`], which the reset or the step then returns.
    fn observe_extra(
        &self,
        simulator: &S,
        memory: &Self::Memory,
        extra: &mut [f64],
    ) -> Result<(), EnvError> {
        let _ = (simulator, memory, extra);
        Ok(())
    }

    /// Returns the points that pictures mark as the goal, in meters in the world frame. By default
    /// every three elements of the goal are one point.
    fn goal_positions<'a>(&self, desired_goal: &'a [f64]) -> Cow<'a, [[f64; 3]]> {
        Cow::Borrowed(desired_goal.as_chunks().0)
    }
}

/// The built-in tasks: the gripper's position is the goal in Reach, and the object's in the others.
impl<S: Simulator> FetchTask<S> for Task {
    type Memory = ();

    fn goal_len(&self) -> usize {
        3
    }

    fn begin_episode(
        &self,
        config: &FetchConfig,
        simulator: &mut S,
        random: &mut NpRandom,
        desired_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        desired_goal.copy_from_slice(&draw_goal(config, &simulator.settled(), random));
        Ok(())
    }

    fn achieved_goal(&self, simulator: &S, _: &(), goal: &mut [f64]) -> Result<(), EnvError> {
        let object = simulator.object().filter(|_| self.has_object());
        let position =
            object.map_or_else(|| simulator.gripper().position, |object| object.position);
        goal.copy_from_slice(position.as_slice());
        Ok(())
    }
}

/// Draws a goal.
///
/// Source: `_sample_goal` of gymnasium-robotics 1.4.2.
pub(super) fn draw_goal(
    config: &FetchConfig,
    settled: &Settled,
    random: &mut NpRandom,
) -> [f64; 3] {
    let range = config.target_range();
    let gripper: [f64; 3] = settled.gripper_position.into();
    let mut goal = gripper.map(|coordinate| coordinate + random.uniform(-range, range));
    for (coordinate, offset) in goal.iter_mut().zip(config.target_offset()) {
        *coordinate += offset;
    }
    if let Some(height) = settled.object_height {
        goal[2] = height;
        if config.target_in_the_air() && random.random() < 0.5 {
            goal[2] += random.uniform(0.0, MAX_TARGET_RISE);
        }
    }
    goal
}
