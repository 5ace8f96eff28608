//! Downloading MuJoCo and the reference's model into the user's cache (feature `download`).
//!
//! Python's pip downloads them from PyPI, or from the index, mirror or folder that it is configured
//! for; every file is checked by its SHA-256, also when it is looked for again. One process writes
//! at a time, and removes what one that was killed has left. Nothing is printed. The same from the
//! command line: `cargo run -p fetch-sim --example download --features download`.
//!
//! xtask includes these files by their path, because it must build within seconds and where
//! fetch-sim cannot.

mod checksums;
mod error;
mod mujoco;
mod reference_model;
mod unpacking;
mod wheel;

pub use error::DownloadError;
pub use mujoco::{export_line, mujoco, mujoco_from_wheel};
pub use reference_model::{reference_model, reference_model_from_wheel};
