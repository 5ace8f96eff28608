//! Code that several commands share.

pub mod process;
pub mod python;
