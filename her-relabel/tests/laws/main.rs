//! The laws of the buffer, one module per subject.
//!
//! `tests/oracle` computes every number of a batch again, from a list of episodes: which goals a
//! strategy may give and how often, the ring, the outcomes, windows, priorities, fields, and rows of
//! vectorized environments. Here are the laws that it cannot see, each of which is broken by some
//! library in use:
//! 1. The ratio holds for a batch of one, and for 0 and 1: `relabeling`.
//! 2. An episode longer than the buffer keeps its end, and no number is used twice: `ring`.
//! 3. Sampling changes nothing, and a batch is not a view of the buffer: `determinism`; it
//!    allocates nothing: `tests/allocation.rs`. A benchmark shows that its time does not grow.
//! 4. A wrong file is an error, and a crash leaves the old file: `saving`, `damaged`, and for numpy
//!    archives `tests/npz`.
//! 5. A seed determines a batch: `determinism`; on any number of threads: `changed`.
//! 6. Priorities of overwritten transitions are ignored: `priorities`.
//! 7. Goals are not rounded before the threshold: `relabeling`.
//! 8. The reward is called once, for the relabeled rows, and may panic: `relabeling`.
//! 9. Readers beside a writer see no torn row: `determinism`.
//! 10. A step without a start is refused where it is recorded: `refused_rows`.
//! 11. Mirrored rows and moved goals change what they say they change, and nothing else: `changed`.
//! 12. A row that has a number is recorded once, after the one before it: `numbered_rows`.
//! 13. A network that acts sees the bits that it learns from: `acting`.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

mod acting;
mod adding;
mod appending;
mod changed;
mod choosing;
mod common;
mod damaged;
mod determinism;
mod errors;
mod fields;
mod format;
mod forms;
mod goals;
mod limits;
mod numbered_rows;
mod priorities;
mod refused_rows;
mod relabeling;
mod ring;
mod saving;
mod step_rows;
mod vectorized;
