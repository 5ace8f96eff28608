//! Checkpoints: everything that a run needs to continue exactly where it was.
//!
//! A checkpoint is a zip archive of `state.json`, `networks.safetensors` and `environment.json`,
//! and of `rank-0.json` and `rank-0.buffer` for each process, each with a checksum, none
//! compressed. The first process writes it to a temporary file, which it then renames: a run that
//! is killed while it writes leaves the last checkpoint as it was.

mod environment;
mod load;
mod resume;
mod save;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::curve::{Counters, CurveRow, Recent};
use super::cycle::Rest;
use super::demonstrated::Demonstrated;
use super::explorer::{ExplorerState, LastBatch};
use super::inputs::Inputs;
use super::settings::TrainSettings;
use crate::collector::CollectorSnapshot;
use crate::evaluate::MAX_COUNT;

pub use resume::Resumed;

/// The version of the format.
const VERSION: u32 = 1;

const STATE: &str = "state.json";
const NETWORKS: &str = "networks.safetensors";
const ENVIRONMENT: &str = "environment.json";

/// The state that all processes share, except the networks.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    version: u32,
    /// The run that the checkpoint belongs to.
    run_id: u64,
    settings: TrainSettings,
    seed: u64,
    /// The number of processes.
    num_ranks: usize,
    counters: Counters,
    recent: Recent,
    rows: Vec<CurveRow>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rest: Option<Rest>,
    inputs: Inputs,
    num_updates: u64,
    /// The demonstrated transitions in the buffer of each process.
    demonstrated: Vec<Demonstrated>,
}

/// The state of one process, except its buffer.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Own<S> {
    explorer: ExplorerState,
    /// `None` before the first step.
    last_batch: Option<LastBatch>,
    collector: CollectorSnapshot<S>,
}

fn own_name(rank: usize) -> String {
    format!("rank-{rank}.json")
}

fn buffer_name(rank: usize) -> String {
    format!("rank-{rank}.buffer")
}

fn checkpoint_path(folder: &Path, steps: u64) -> PathBuf {
    folder.join(format!("checkpoint-{steps:012}.zip"))
}

/// Returns the checkpoints of a folder, oldest first: the files with names that
/// [`Trainer::save`](super::Trainer::save) gives, whatever their contents.
///
/// # Errors
/// The errors of reading the folder.
pub fn checkpoints(folder: impl AsRef<Path>) -> io::Result<Vec<PathBuf>> {
    Ok(checkpoints_by_steps(folder.as_ref())?.into_values().collect())
}

/// Returns the checkpoints of a folder by their numbers of steps.
fn checkpoints_by_steps(folder: &Path) -> io::Result<BTreeMap<u64, PathBuf>> {
    let mut paths = BTreeMap::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let digits = name.strip_prefix("checkpoint-").and_then(|name| name.strip_suffix(".zip"));
        if let Some(steps) = digits.and_then(|digits| digits.parse().ok())
            && checkpoint_path(folder, steps) == path
        {
            paths.insert(steps, path);
        }
    }
    Ok(paths)
}

/// The fields by which a checkpoint is recognized.
#[derive(Deserialize)]
struct Header {
    version: u32,
    run_id: u64,
}

fn parse(state: &[u8]) -> Result<Saved, String> {
    let read = |error: serde_json::Error| error.to_string();
    match serde_json::from_slice(state).map_err(read)? {
        Header { version: VERSION, .. } => {}
        Header { version, .. } => {
            return Err(format!("it has version {version}, and this crate reads {VERSION}"));
        }
    }
    let saved: Saved = serde_json::from_slice(state).map_err(read)?;
    saved.check()?;
    Ok(saved)
}

impl Saved {
    /// Checks that a run could have left this state.
    fn check(&self) -> Result<(), String> {
        if self.num_ranks == 0 {
            return Err("it has no processes".to_owned());
        }
        if self.demonstrated.len() != self.num_ranks {
            return Err("it has demonstrations for a different number of processes".to_owned());
        }
        for demonstrated in &self.demonstrated {
            check_counts([("demonstrated transitions", demonstrated.unseen)])?;
        }
        self.settings.check().map_err(|error| error.to_string())?;
        for row in &self.rows {
            check_counts(row.counters.counts())?;
        }
        check_counts(self.counters.counts())?;
        check_counts(self.recent.counts())?;
        let left = self.rest.map_or(0, |rest| rest.updates);
        if left > self.settings.schedule.updates_per_cycle as u64 {
            return Err(format!("{left} updates of its cycle are left, more than a cycle has"));
        }
        if self.num_updates != self.counters.updates {
            let (networks, run) = (self.num_updates, self.counters.updates);
            return Err(format!("its networks have had {networks} updates, but its run {run}"));
        }
        if !self.inputs.have(&self.settings.inputs) {
            return Err("its networks have different inputs than its settings say".to_owned());
        }
        Ok(())
    }
}

impl<S: DeserializeOwned> Own<S> {
    /// Reads the state of a process; environments check their snapshots themselves.
    fn read(bytes: &[u8]) -> Result<Self, String> {
        let own: Self = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
        check_counts(own.explorer.counts())?;
        Ok(own)
    }
}

fn check_counts<const N: usize>(counts: [(&str, u64); N]) -> Result<(), String> {
    match counts.iter().find(|(_, count)| *count > MAX_COUNT) {
        Some((what, count)) => Err(format!("it counts {count} {what}")),
        None => Ok(()),
    }
}
