//! The groups into which the goals of a task fall.

use fetch_env::{Task, goal_reward::goal_distance};

use super::episode::Episode;

/// The height above the object at which a goal of PickAndPlace is in the air (meters).
const AIR: f64 = 0.01;

/// The names of PickAndPlace's strata.
const HEIGHTS: [&str; 2] = ["air", "table"];

/// The names of Slide's strata.
const RINGS: [&str; 5] =
    ["0 to 0.3 m", "0.3 to 0.5 m", "0.5 to 0.6 m", "0.6 to 0.7 m", "from 0.7 m"];

/// The distances that divide [`RINGS`] (meters).
const RADII: [f64; 4] = [0.3, 0.5, 0.6, 0.7];

/// Returns the names of a task's strata, which are groups of goals; none in Reach and Push.
///
/// In PickAndPlace a goal is in the `air` or on the `table`. In Slide goals are by their distance
/// from the puck's start.
#[must_use]
pub const fn strata_of(task: Task) -> &'static [&'static str] {
    match task {
        Task::PickAndPlace => &HEIGHTS,
        Task::Slide => &RINGS,
        Task::Reach | Task::Push => &[],
    }
}

/// Returns the name of an episode's stratum, one of [`strata_of`] its task; `None` if the task has
/// none or the goals are not known.
#[must_use]
pub fn stratum(task: Task, episode: &Episode) -> Option<&'static str> {
    let controls = episode.controls.as_ref()?;
    let (start, goal) = (&controls.start_goal, &controls.desired_goal);
    match task {
        Task::PickAndPlace => {
            let is_in_air = goal.get(2)? - start.get(2)? > AIR;
            Some(HEIGHTS[usize::from(!is_in_air)])
        }
        Task::Slide => {
            let distance = goal_distance(start, goal);
            RINGS.get(RADII.iter().filter(|radius| distance >= **radius).count()).copied()
        }
        Task::Reach | Task::Push => None,
    }
}
