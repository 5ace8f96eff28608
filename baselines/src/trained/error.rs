//! The errors of loading trained policies.

use std::io;
use std::path::PathBuf;

use fetch_env::Task;

/// Error returned when a [`TrainedPolicy`](crate::TrainedPolicy) cannot be loaded or used.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum TrainedPolicyError {
    /// The file cannot be read.
    #[error("{} cannot be read", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the file system.
        source: io::Error,
    },
    /// The file cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the file system.
        source: io::Error,
    },
    /// The file is too large for a policy.
    #[error("{} has more than {limit} bytes: it is not a policy", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The largest size that is read.
        limit: u64,
    },
    /// The policy is too large to be loaded again.
    #[error(
        "the policy takes {actual} bytes, and at most {limit} are loaded: use smaller layers, or \
         shorter settings"
    )]
    Size {
        /// The size of its file.
        actual: u64,
        /// The largest size that is read.
        limit: u64,
    },
    /// The file's contents are not those of a policy.
    #[error("{} is not a policy that can be loaded", path.display())]
    Contents {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: Box<Self>,
    },
    /// The file is damaged, or not a safetensors file.
    #[error("the file is damaged, or not a safetensors file: {reason}")]
    Format {
        /// What is wrong.
        reason: String,
    },
    /// The file has no policy header.
    #[error("the file has no valid policy header under the key `policy`: {reason}")]
    Header {
        /// What is wrong.
        reason: String,
    },
    /// The file has a different version.
    #[error("the file has version {version}, and this crate reads version {expected}")]
    Version {
        /// The file's version.
        version: u32,
        /// The version that is read.
        expected: u32,
    },
    /// The policy is of the other kind.
    #[error("the policy sees {sees}: load it as a {load}")]
    Kind {
        /// What it sees.
        sees: &'static str,
        /// The type of such policies.
        load: &'static str,
    },
    /// A `PixelPolicy` has a network that does not fit what it sees.
    #[error("the network does not fit what the policy sees: {reason}")]
    Sight {
        /// What is wrong.
        reason: String,
    },
    /// A tensor is missing, or has a different shape or type than the header says.
    #[error("the tensor {tensor} is {actual}: expected {expected}")]
    Tensor {
        /// The tensor.
        tensor: String,
        /// What it is.
        actual: String,
        /// What it should be.
        expected: String,
    },
    /// A weight is not a finite number.
    #[error("the tensor {tensor} has the number {value} at {index}: the training has diverged")]
    NotFinite {
        /// The tensor.
        tensor: String,
        /// The place in it.
        index: usize,
        /// The number.
        value: f32,
    },
    /// States and actions have different numbers of rows.
    #[error("the {what} have {actual} numbers: pass {rows} rows of {len}")]
    Rows {
        /// What has a wrong length.
        what: &'static str,
        /// Its length.
        actual: usize,
        /// The number of rows.
        rows: usize,
        /// The length of a row.
        len: usize,
    },
    /// A number of a state is NaN, infinite, or too large for `f32`.
    #[error("{part}[{index}] of row {row} is {value:?}: pass numbers that are finite in `f32`")]
    StateNotFinite {
        /// `observation`, `achieved_goal` or `desired_goal`.
        part: &'static str,
        /// The row.
        row: usize,
        /// The index in the row.
        index: usize,
        /// The number.
        value: f64,
    },
    /// No policy of the task was trained in a world that varies.
    #[error(
        "no robust policy of {task} comes with this crate: choose Push or PickAndPlace, or train \
         one with `fetch-env train --vary`"
    )]
    NotRobust {
        /// The task.
        task: Task,
    },
    /// No policy of the task that sees pictures comes with this crate.
    #[cfg(feature = "pixel-policies")]
    #[error(
        "no policy of {task} that sees pictures comes with this crate: choose Push or \
         PickAndPlace, or train one with `fetch-env train --pixels`"
    )]
    NoPixels {
        /// The task.
        task: Task,
    },
}

debug_as_display!(TrainedPolicyError);
