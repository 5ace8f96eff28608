//! Checkpoints: everything that a run needs to continue exactly where it was.
//!
//! A checkpoint is a zip archive of `state.json`, `networks.safetensors` and `environment.json`,
//! and of `rank-0.json` and `rank-0.buffer` for each process, each with a checksum, none
//! compressed. That of a run with an actor that sees pictures has `eyes.safetensors` and
//! `frames.bytes`, too. The first process writes it to a temporary file, which it then renames: a
//! run that is killed while it writes leaves the last checkpoint as it was.

pub(crate) mod environment;
pub(crate) mod format;
pub(crate) mod load;
pub(crate) mod resume;
pub(crate) mod save;
