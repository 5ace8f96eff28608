//! Code that the programs of `cargo xtask` share: the names of all commands, running a command, and
//! its output.
//!
//! It builds in a second, because xtask runs on a bare machine.
#![forbid(unsafe_code)]

mod names;
mod output;
mod program;

pub use names::{COMMANDS, Listed, Program, find, of};
pub use output::{end_with, tell, write_line};
pub use program::{Command, run};
