//! An oracle of the buffer: a plain list of episodes, written from the documentation and not from
//! the code.
//!
//! - [`list`] is the list, and [`world`] does the same [`events`] at random to a list and to a
//!   buffer.
//! - [`rows`] computes every number of a batch again, from the list and the task of [`task`].
//! - [`exact`] compares both in random worlds: nothing may differ by a bit where the documentation
//!   determines it.
//! - [`draws`] counts draws where the documentation claims probabilities, and says which bias it
//!   notices.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

mod draws;
mod events;
mod exact;
mod list;
mod rows;
mod task;
mod world;
