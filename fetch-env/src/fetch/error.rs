//! The errors of the settings of Fetch environments.

use fetch_sim::Task;
use goal_reward::ThresholdError;

/// Error returned for invalid settings of a Fetch environment.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A setting of the object in a task without one.
    #[error("{task} has no object, so {option} cannot be set: leave it out")]
    NoObject {
        /// The task.
        task: Task,
        /// Name of the setting.
        option: &'static str,
    },
    /// A range from which nothing can be drawn.
    #[error("{option} is {value}: pass a number of meters from {least} to {most}")]
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
    #[error("target_offset[{axis}] is {value}: pass a number of meters from -{most} to {most}")]
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
}
