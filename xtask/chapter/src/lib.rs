//! The chapter's commands: its checks, its pipeline, its exercises and its doctor.
//!
//! The lab shows the checks of [`verify`] and a [`Trajectory`] on its pages, and prints and writes
//! results as these commands do.
#![forbid(unsafe_code)]

#[macro_use(say)]
extern crate commands;

mod all;
mod bridge;
pub mod check;
mod choice;
mod describe;
mod doctor;
mod exercise;
pub mod json;
mod random_episodes;
pub mod reference;
mod reward_check;
mod rewards;
mod task_pages;
pub mod verify;

pub use choice::parse_env_id;
pub use exercise::{StepRewards, Trajectory};

use commands::Command;

/// The commands.
pub const COMMANDS: [Command; 9] = [
    verify::COMMAND,
    bridge::COMMAND,
    describe::COMMAND,
    reward_check::COMMAND,
    random_episodes::COMMAND,
    all::COMMAND,
    exercise::COMMAND,
    doctor::COMMAND,
    task_pages::COMMAND,
];
