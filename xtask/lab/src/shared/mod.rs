//! Code that several commands share.

pub use chapter::{check, json};

pub mod choice;
pub mod process;
pub mod progress;
pub mod python;
pub mod ranks;
pub mod signals;
pub mod usage;
