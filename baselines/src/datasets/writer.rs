//! What writes a data set.

use super::episode::EpisodeRecord;
use super::error::DatasetError;

/// Writes the episodes of a data set.
///
/// A writer that is dropped before it has finished removes what it has written, and the folders that
/// it made. A killed process leaves them, and the next writer in the same folder of data sets removes
/// them.
pub trait DatasetWriter {
    /// Writes the next episode.
    ///
    /// # Errors
    /// [`DatasetError::Length`] if the episode comes from a different environment than the data
    /// set, which then stays unchanged; [`DatasetError::File`] if a file cannot be written.
    fn write(&mut self, episode: &EpisodeRecord) -> Result<(), DatasetError>;

    /// Returns whether the episodes must have [snapshots](EpisodeRecord::with_snapshots).
    fn needs_snapshots(&self) -> bool {
        false
    }

    /// Finishes the data set and gives it its name.
    ///
    /// # Errors
    /// [`DatasetError::Exists`] if something with that name exists by now; [`DatasetError::File`]
    /// if it cannot be written; [`DatasetError::TooFew`].
    fn finish(self: Box<Self>) -> Result<(), DatasetError>;
}

/// Returns an empty record that keeps what the writers write.
pub(super) fn record_for(writers: &[Box<dyn DatasetWriter>]) -> EpisodeRecord {
    let record = EpisodeRecord::default();
    let needs_snapshots = writers.iter().any(|writer| writer.needs_snapshots());
    if needs_snapshots { record.with_snapshots() } else { record }
}
