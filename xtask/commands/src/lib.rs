//! What the programs of `cargo xtask` share: the names of all commands, how one of a program's is
//! run, and what it prints.
//!
//! It builds in a second: xtask runs on a bare machine.
#![forbid(unsafe_code)]

mod names;
mod output;
mod program;

pub use names::{COMMANDS, Listed, Program, find, of};
pub use output::{end_with, tell, write_line};
pub use program::{Command, run};
