//! Exchanging episodes with numpy.
#![cfg(feature = "npz")]
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

mod arrays;
mod bounds;
mod common;
mod episodes;
mod files;
mod ogbench;
