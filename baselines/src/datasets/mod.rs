//! Data sets that other projects read: in Minari's format (feature `minari`) and OGBench's (feature
//! `ogbench`). `import_minari` reads Minari's into a replay buffer.
//!
//! A data set is a function of its settings and its first seed: on the same version of MuJoCo it
//! has the same bytes on each machine. It is written episode by episode, so memory does not grow
//! with its length, and under a temporary name until it is complete.
//!
//! ```
//! # #[cfg(feature = "minari")] {
//! use baselines::datasets::{Metadata, EpisodeRecord, MinariWriter, SetKind, SetPolicy};
//! use fetch_env::make;
//!
//! let folder = tempfile::tempdir()?;
//! let mut env = make("FetchReach-v4")?;
//! let mut policy = SetPolicy::new(SetKind::Mixed, &env)?;
//! let metadata = Metadata::new("fetch/reach/mixed-v0", &env, policy.describe(), "")?;
//! let mut writer = MinariWriter::create(folder.path(), metadata)?;
//! let mut record = EpisodeRecord::default();
//! for seed in 0..4 {
//!     policy.begin(seed);
//!     record.record(&mut env, &mut policy, seed)?;
//!     writer.write(&record)?;
//! }
//! writer.finish()?;
//! assert!(folder.path().join("fetch/reach/mixed-v0/data/3/part-0.arrow").exists());
//! # }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod episode;
mod error;
mod metadata;
#[cfg(feature = "minari")]
mod minari;
#[cfg(feature = "ogbench")]
mod ogbench;
#[cfg(feature = "learn")]
mod replay;
mod set;
mod staged_folder;
mod writer;

pub use episode::EpisodeRecord;
pub use error::DatasetError;
pub use metadata::Metadata;
#[cfg(feature = "minari")]
pub use minari::{error::MinariError, import::import_minari, writer::MinariWriter};
#[cfg(feature = "ogbench")]
pub use ogbench::writer::OgBenchWriter;
#[cfg(feature = "learn")]
pub use replay::{ReplayError, write_replay};
pub use set::{SetKind, SetPolicy, write_set};
pub use writer::DatasetWriter;
