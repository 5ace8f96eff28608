//! Values that processes send to each other.

use serde::{Serialize, de::DeserializeOwned};

use super::Workers;

/// A process sent a message that cannot be read.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "rank {rank} sent a message that cannot be read ({reason}): start all ranks with the same \
     program"
)]
#[non_exhaustive]
pub struct UnreadableMessage {
    /// The process that sent it.
    pub rank: usize,
    /// What is wrong with it.
    pub reason: String,
}

debug_as_display!(UnreadableMessage);

/// Sends a value to all processes, and returns the values of all. They are sent as JSON, which has
/// no infinity and no NaN.
///
/// # Errors
/// [`UnreadableMessage`] of the first process whose value cannot be written or read.
pub fn gather_values<T: Serialize + DeserializeOwned>(
    workers: &mut dyn Workers,
    value: &T,
) -> Result<Vec<T>, UnreadableMessage> {
    // A value that cannot be written is sent as an empty message, and all then name this process.
    let messages = workers.gather(&serde_json::to_vec(value).unwrap_or_default());
    let read = |(rank, message): (usize, &Vec<u8>)| {
        serde_json::from_slice(message)
            .map_err(|error| UnreadableMessage { rank, reason: error.to_string() })
    };
    messages.iter().enumerate().map(read).collect()
}

/// Returns the sum of a number over all processes.
///
/// # Errors
/// [`UnreadableMessage`].
pub fn sum(workers: &mut dyn Workers, number: u64) -> Result<u64, UnreadableMessage> {
    Ok(gather_values(workers, &number)?.into_iter().fold(0, u64::wrapping_add))
}
