//! The chapter's commands: its checks, its pipeline, its exercises and its doctor.

pub mod all;
pub mod bridge;
pub mod describe;
pub mod doctor;
pub mod exercise;
pub mod random_episodes;
pub mod reward_check;
mod rewards;
pub mod verify;
