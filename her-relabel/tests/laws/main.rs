//! The laws of the buffer, one module a subject.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

mod adding;
mod common;
mod determinism;
mod fields;
mod goals;
mod outcomes;
mod priorities;
mod relabelling;
mod ring;
mod saving;
mod vectorised;
