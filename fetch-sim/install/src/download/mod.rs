//! Downloading MuJoCo and the reference's model into the user's cache (feature `download`).
//!
//! Python's pip downloads them from PyPI, or from the index, mirror or folder that it is configured
//! for. The SHA-256 of every file is checked, again on each call. One process writes at a time, and
//! cleans up after one that was killed. Nothing is printed.

mod checksums;
mod error;
mod lock_file;
mod mujoco;
mod platform;
mod reference_model;
mod remember;
mod unpacking;
mod wheel;

pub use error::DownloadError;
pub use mujoco::{export_line, mujoco, mujoco_for, mujoco_from_wheel};
pub use reference_model::{reference_model, reference_model_from_wheel};
pub use remember::{forget, remember};
