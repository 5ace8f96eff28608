//! Learning: the laws that every run keeps.

mod bad_input;
mod ranks;
mod resuming;
mod runs;
