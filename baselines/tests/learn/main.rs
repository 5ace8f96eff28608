//! Learning: the laws that every run keeps.

mod bad_input;
mod evaluating;
mod ranks;
mod resuming;
mod runs;
