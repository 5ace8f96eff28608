//! The environments whose episodes can be played back, and how their states are shown.

use std::any::{Any, TypeId};

use fetch_env::wrappers::{GoalWrapper, Wrapped};
use fetch_env::{EnvId, FetchEnv, FetchTask, GoalEnv, GoalReward, Task};
use fetch_sim::{MujocoSimulator, Simulator};

/// An environment whose episodes can be played back.
///
/// All Fetch environments can, in all wrappers that keep goals: in 3-D on MuJoCo, and as plots on
/// other simulators. Your own environment needs one line to show plots of its observations, and one
/// method to show its [`scene`](Self::scene) instead:
///
/// ```
/// use baselines::page::{PlaybackEnv, Scene};
/// # use fetch_env::{Env, EnvError, GoalEnv, KinematicEnv, Reset, Space, Step};
/// # #[derive(Clone)]
/// # struct Maze(KinematicEnv);
/// # impl Maze { fn rgb(&self) -> Vec<u8> { vec![255; 64 * 48 * 3] } }
/// # impl Env for Maze {
/// #     type Observation = <KinematicEnv as Env>::Observation;
/// #     type Info = <KinematicEnv as Env>::Info;
/// #     type ActionSpace = <KinematicEnv as Env>::ActionSpace;
/// #     type ResetOptions = <KinematicEnv as Env>::ResetOptions;
/// #     fn reset_with(&mut self, seed: Option<u64>, options: &Self::ResetOptions)
/// #     -> Result<Reset<Self::Observation, Self::Info>, EnvError> {
/// #         self.0.reset_with(seed, options)
/// #     }
/// #     fn step(&mut self, action: &[f32])
/// #     -> Result<Step<Self::Observation, Self::Info>, EnvError> {
/// #         self.0.step(action)
/// #     }
/// #     fn action_space(&self) -> &Self::ActionSpace { self.0.action_space() }
/// #     fn observation_space(&self) -> &Space { self.0.observation_space() }
/// # }
/// # impl GoalEnv for Maze {
/// #     type GoalReward = <KinematicEnv as GoalEnv>::GoalReward;
/// #     fn goal_reward(&self) -> &Self::GoalReward { self.0.goal_reward() }
/// # }
///
/// impl PlaybackEnv for Maze {
///     fn scene(&self) -> Scene<'_> {
///         Scene::Picture { rgb: self.rgb(), width: 64, height: 48 }
///     }
/// }
/// # let mut maze = Maze(fetch_env::make_kinematic("FetchReach-v4")?);
/// # let html = baselines::page::episode_page(&mut maze, &mut baselines::ZeroPolicy, 0)?;
/// # assert!(html.contains("data:image/png"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait PlaybackEnv: GoalEnv {
    /// Returns the scene of the current state: the same kind in all states of an episode. The
    /// default is [`Scene::Columns`].
    fn scene(&self) -> Scene<'_> {
        Scene::Columns
    }

    /// Returns the points of the episode's goal that are drawn among [bodies](Scene::Bodies), in
    /// meters in the world frame. By default, every three elements of the goal are one point.
    fn goal_positions(&self, desired_goal: &[f64]) -> Vec<[f64; 3]> {
        desired_goal.as_chunks().0.to_vec()
    }

    /// Returns the environment's name in titles, such as its id.
    fn title(&self) -> String {
        "Episode".into()
    }
}

/// How a state is shown.
#[derive(Debug)]
#[non_exhaustive]
pub enum Scene<'a> {
    /// The bodies of a simulation, drawn in 3-D.
    Bodies(&'a MujocoSimulator),
    /// A picture. A picture with more than 480 pixels along a side is shrunk.
    Picture {
        /// Height x width x 3 (red, green, blue), the top row first.
        rgb: Vec<u8>,
        /// The number of pixels in a row.
        width: usize,
        /// The number of rows.
        height: usize,
    },
    /// Plots of the elements of observations and goals over the steps.
    Columns,
}

impl<S, R, T> PlaybackEnv for FetchEnv<S, R, T>
where
    S: Simulator + 'static,
    R: GoalReward,
    T: FetchTask<S> + 'static,
{
    fn scene(&self) -> Scene<'_> {
        let simulator: &dyn Any = self.simulator();
        simulator.downcast_ref().map_or(Scene::Columns, Scene::Bodies)
    }

    fn goal_positions(&self, _desired_goal: &[f64]) -> Vec<[f64; 3]> {
        // The environment's own goal, whatever a wrapper makes of it.
        Self::goal_positions(self).into_owned()
    }

    fn title(&self) -> String {
        if TypeId::of::<T>() == TypeId::of::<Task>() {
            EnvId { task: self.config().task(), reward: self.config().reward() }.to_string()
        } else {
            "Fetch".into()
        }
    }
}

impl<E: PlaybackEnv, W: GoalWrapper<E>> PlaybackEnv for Wrapped<E, W> {
    fn scene(&self) -> Scene<'_> {
        self.inner().scene()
    }

    fn goal_positions(&self, desired_goal: &[f64]) -> Vec<[f64; 3]> {
        self.inner().goal_positions(desired_goal)
    }

    fn title(&self) -> String {
        self.inner().title()
    }
}
