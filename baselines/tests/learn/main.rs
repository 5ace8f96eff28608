//! Learning: the laws that every run keeps.

mod bad_input;
mod resuming;
mod runs;
