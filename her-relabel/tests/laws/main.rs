//! The laws of the buffer, one module per subject.
//!
//! Each law is broken by some library in use:
//! 1. Future goals are uniform over the states after the step, and final ones are the last state,
//!    also in an episode of one step: `relabeling`.
//! 2. No goal comes from another episode or environment, and goals are independent: `relabeling`,
//!    `ring`.
//! 3. The ratio holds for a batch of one, an episode of one, and for 0 and 1: `relabeling`.
//! 4. The ring is a list of episodes that keeps the newest steps, each equally likely: `ring`.
//! 5. Sampling changes nothing, and a batch is not a view of the buffer: `determinism`; it
//!    allocates nothing: `tests/allocation.rs`. A benchmark shows that its time does not grow.
//! 6. A cleared buffer is empty, and environments do not mix: `ring`, `vectorized`.
//! 7. A loaded buffer equals the saved one, even in the middle of an episode; a wrong file is an
//!    error, and a crash leaves the old file: `saving`, `damaged`, and for numpy archives
//!    `tests/npz`.
//! 8. A seed determines a batch, on any number of threads: `determinism`, `priorities`.
//! 9. A window has one goal, for all its rewards, and ends with the episode: `outcomes`.
//! 10. Weight 0 is never drawn, and weights of overwritten transitions are ignored: `priorities`.
//! 11. Goals are not rounded before the threshold: `relabeling`.
//! 12. The reward is called once, for the relabeled rows, and may panic: `relabeling`.
//! 13. Readers beside a writer see no torn row: `determinism`.
//! 14. A step without a start is refused where it is recorded: `refused_rows`.
//! 15. Mirrored rows and moved goals change what they say they change, and nothing else: `changed`.
//! 16. A row that has a number is recorded once, after the one before it: `numbered_rows`.
//! 17. A network that acts sees the bits that it learns from: `acting`.
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
mod outcomes;
mod priorities;
mod refused_rows;
mod relabeling;
mod ring;
mod saving;
mod step_rows;
mod vectorized;
