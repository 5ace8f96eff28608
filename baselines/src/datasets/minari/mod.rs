//! Minari's format, version 0.5: a folder with a JSON file and an Arrow file for each episode.

mod arrow;
mod columns;
mod environment;
pub(super) mod error;
pub(super) mod import;
mod spaces;
mod table;
pub(super) mod writer;
