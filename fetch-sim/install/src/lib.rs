//! Where MuJoCo and the models of the Fetch robot are on a machine.
//!
//! [`Places`] finds an installation for a build, [`remembered`] is the version that the user has asked
//! for once, and [`cache_folder`] the folder into which `download` (of the feature `download`) puts
//! MuJoCo and the reference's model. Without that feature the crate needs only the standard library, because build scripts use it, and task
//! runners that build within seconds.
//!
//! Nothing here checks whether a program has more privileges than the user who started it. One that
//! may have them uses `fetch_sim`, which then ignores that user's variables and cache.
#![forbid(unsafe_code)]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod contents;
#[cfg(feature = "download")]
pub mod download;
mod folders;
mod installation;
pub mod regular_file;
mod remembered;
mod search;

pub use folders::{NONE, cache_folder, mujoco_dir, name_in_cache, own_platform, reference_folder};
pub use installation::{libraries_in, libraries_of, version_in_name};
pub use remembered::{Remembered, UnusableChoice, remembered, remembering_file};
pub use search::{Found, NotMujoco, Origin, Places, SYSTEM_PREFIXES};
