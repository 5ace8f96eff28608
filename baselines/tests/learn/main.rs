//! Learning: the laws that every run keeps.

mod bad_input;
mod damaged_checkpoints;
mod evaluating;
mod folders;
mod ranks;
mod resuming;
mod runs;
mod settings;
#[allow(dead_code, reason = "its other users need more of it")]
#[path = "../../../fetch-env/tests/laws/tree.rs"]
mod tree;
