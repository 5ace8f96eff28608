//! The object that `--json` writes, and writing files.

use std::{
    fmt, fs,
    io::Write as _,
    path::{Path, PathBuf},
};

use anyhow::Context;
use fetch_sim::MujocoVersion;
use her_relabel::files;
use serde::Serialize;

/// The object: versions, machine, settings and results of one command.
#[derive(Debug, Serialize)]
struct Output<S> {
    versions: Versions,
    machine: Machine,
    settings: S,
    results: Vec<Named>,
}

/// The versions that a result depends on.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Versions {
    /// This project's.
    pub(crate) project: &'static str,
    /// That of MuJoCo's headers.
    pub(crate) mujoco: String,
}

#[derive(Clone, Debug, Serialize)]
struct Machine {
    os: &'static str,
    arch: &'static str,
    cores: usize,
}

/// A number with a unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Metric {
    /// The number.
    pub value: f64,
    unit: &'static str,
}

#[derive(Debug, Serialize)]
struct Named {
    name: String,
    #[serde(flatten)]
    figure: Metric,
}

impl Metric {
    /// Returns a number with a unit, which is `1` for a pure number.
    pub const fn new(value: f64, unit: &'static str) -> Self {
        Self { value, unit }
    }

    /// Returns a count.
    pub const fn count(value: usize) -> Self {
        Self::new(value as f64, "1")
    }
}

impl fmt::Display for Metric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { value, unit } = *self;
        let decimals = if value.abs() < 100.0 { 3 } else { 0 };
        write!(f, "{value:>14.decimals$} {}", if unit == "1" { "" } else { unit })
    }
}

impl Versions {
    /// Returns the versions of this build.
    pub(crate) fn current() -> Self {
        let mujoco =
            MujocoVersion::of_headers().map_or("none".into(), |version| version.to_string());
        Self { project: env!("CARGO_PKG_VERSION"), mujoco }
    }
}

/// Writes the results of this process, if a path is given.
///
/// # Errors
/// The file cannot be written.
pub fn write_results(
    path: Option<&PathBuf>,
    settings: impl Serialize,
    results: impl IntoIterator<Item = (String, Metric)>,
) -> anyhow::Result<()> {
    let Some(path) = path else { return Ok(()) };
    let machine = Machine {
        os: std::env::consts::OS,
        arch: std::env::consts::ARCH,
        cores: std::thread::available_parallelism().map_or(1, usize::from),
    };
    let results = results.into_iter().map(|(name, figure)| Named { name, figure }).collect();
    write_json(path, &Output { versions: Versions::current(), machine, settings, results })
}

/// Writes a value as JSON, making missing folders.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> anyhow::Result<()> {
    write_text(path, &(serde_json::to_string_pretty(value)? + "\n"))
}

/// Writes a file, making missing folders. A regular file appears whole or not at all; a device or a
/// pipe gets the bytes directly.
///
/// # Errors
/// The file cannot be written.
pub fn write_text(path: &Path, text: &str) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let is_special = fs::metadata(path).is_ok_and(|metadata| !metadata.is_file());
    if is_special {
        return fs::write(path, text).with_context(|| format!("cannot write {}", path.display()));
    }
    files::replace(path, |file| file.write_all(text.as_bytes()))
        .with_context(|| format!("cannot write {}", path.display()))
}

/// Writes a file of a folder, which appears whole or not at all. It replaces an existing file, and
/// also a symbolic link.
///
/// # Errors
/// The file cannot be written, or a folder, a pipe or the like has its name.
#[cfg(feature = "full")]
pub(crate) fn replace_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    files::replace_entry(path, |file| file.write_all(bytes))
        .with_context(|| format!("cannot write {}", path.display()))
}
