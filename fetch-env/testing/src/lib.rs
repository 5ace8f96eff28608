//! Code that the tests and fuzz targets of several packages share.
#![forbid(unsafe_code)]
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a panic fails a test")]

use std::env;
use std::fmt::Display;

#[cfg(feature = "arbitrary")]
mod edit;
#[cfg(unix)]
mod in_child;
mod numbers;
pub mod program;
mod simulator;

#[cfg(feature = "arbitrary")]
pub use edit::{Input, Node};
#[cfg(unix)]
pub use in_child::in_child;
pub use numbers::{Number, numbers, with_each_number_replaced, with_number_replaced};
pub use simulator::{Delegating, Fault, Faulty, OnStep};

/// The result of a test.
pub type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// Returns `None` if something was not made because there is no OpenGL, unless the environment
/// variable `MUJOCO_GL` demands it.
///
/// # Errors
/// Every other error.
pub fn unless_blind<T, E: Display>(made: Result<T, E>) -> Result<Option<T>, E> {
    match made {
        // The type of the error would make everything that is tested need MuJoCo.
        Err(error)
            if error.to_string().starts_with("there is no OpenGL to render with")
                && env::var_os("MUJOCO_GL").is_none() =>
        {
            Ok(None)
        }
        made => made.map(Some),
    }
}

/// Returns the bits of vectors, one after another, to compare and to print.
pub fn bits<const N: usize>(parts: [&[f64]; N]) -> Vec<u64> {
    parts.into_iter().flatten().map(|number| number.to_bits()).collect()
}
