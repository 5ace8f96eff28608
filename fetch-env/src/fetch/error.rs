//! Errors of making and running Fetch environments.

use std::convert::Infallible;

use fetch_sim::{SimError, Task};
use goal_reward::ThresholdError;

use super::variation::error::VariationError;
use crate::gym::{error::EnvError, spaces::error::SpaceError, vec_env::error::VecEnvError};

/// Error returned when a Fetch environment cannot be configured or made.
///
/// `?` turns it into an [`EnvError`], where [`EnvError::downcast_ref`] finds it again.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MakeError {
    /// No environment has this name.
    #[error(
        "there is no environment {id:?}: the nearest are {}, {} and {}",
        nearest[0], nearest[1], nearest[2]
    )]
    UnknownId {
        /// The name.
        id: String,
        /// The most similar names, the nearest first.
        nearest: [String; 3],
    },
    /// An object setting in a task without an object.
    #[error("{task} has no object, so {option} cannot be set: leave it out")]
    NoObject {
        /// The task.
        task: Task,
        /// Name of the setting.
        option: &'static str,
    },
    /// A range from which nothing can be drawn.
    #[error("{option} is {value:?}: pass a number of meters from {least} to {most}")]
    Range {
        /// Name of the setting.
        option: &'static str,
        /// Its value, in meters.
        value: f64,
        /// The smallest valid value, in meters.
        least: f64,
        /// The largest valid value, in meters.
        most: f64,
    },
    /// An offset that is NaN or too large.
    #[error("target_offset[{axis}] is {value:?}: pass a number of meters from -{most} to {most}")]
    Offset {
        /// Index of the axis: x, y, z.
        axis: usize,
        /// The offset, in meters.
        value: f64,
        /// The largest valid offset, in meters.
        most: f64,
    },
    /// A distance threshold that is negative or not finite.
    #[error(transparent)]
    Threshold(#[from] ThresholdError),
    /// A count that is 0 or too large.
    #[error("{option} is {value}: pass a number from 1 to {most}")]
    Count {
        /// Name of the setting.
        option: &'static str,
        /// Its value.
        value: u32,
        /// The largest valid value.
        most: u32,
    },
    /// A task whose goals have no elements.
    #[error("the task's goals have no elements: return at least 1 from goal_len()")]
    EmptyGoal,
    /// A simulator made from settings other than the configuration's.
    #[error(
        "the simulator does not fit the configuration ({reason}): make it from the configuration's \
         sim()"
    )]
    SimulatorMismatch {
        /// The difference between the two.
        reason: String,
    },
    /// The environment cannot draw the configuration's variation.
    #[error(transparent)]
    Variation(#[from] VariationError),
    /// MuJoCo cannot be used, or refuses the model.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The spaces cannot be made.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// The caller of `make_vec_while` has stopped it.
    #[error("not all environments were made, because the caller has stopped it")]
    Stopped,
    /// The environments cannot be stepped together.
    #[error(transparent)]
    Vec(#[from] VecEnvError),
}

debug_as_display!(MakeError);

/// Error returned by a reset for a start that is impossible.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The gripper does not get to where it should start.
    #[error(
        "the gripper gets from {from:?} to {reached:?} and not to the option gripper_position: \
         choose a point above the table and within the arm's reach"
    )]
    OutOfReach {
        /// Where the scene has settled, in meters.
        from: [f64; 3],
        /// Where it stopped, in meters.
        reached: [f64; 3],
    },
    /// The object slipped out of the hand.
    #[error(
        "the object slips out of the hand at the option object_in_gripper: choose a \
         gripper_position above the table, and an object that fits between the fingers"
    )]
    Slipped,
}

debug_as_display!(StartError);

/// A [`FetchConfig`](super::config::FetchConfig) needs no conversion that could fail.
impl From<Infallible> for MakeError {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

impl From<MakeError> for EnvError {
    fn from(error: MakeError) -> Self {
        Self::other(error)
    }
}

impl From<VariationError> for EnvError {
    fn from(error: VariationError) -> Self {
        Self::other(error)
    }
}

impl From<StartError> for EnvError {
    fn from(error: StartError) -> Self {
        Self::other(error)
    }
}

impl From<SimError> for EnvError {
    fn from(error: SimError) -> Self {
        match error {
            // One variant to match on, whichever layer finds the difference.
            SimError::ForeignSnapshot { reason } => Self::ForeignSnapshot { reason },
            error => Self::other(error),
        }
    }
}
