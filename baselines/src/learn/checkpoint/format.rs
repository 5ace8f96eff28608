//! The parts of a checkpoint, and what a run could have left in them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::collector::CollectorSnapshot;
use crate::evaluate::MAX_COUNT;
use crate::learn::error::CheckpointError;
use crate::learn::run::curve::{Counters, CurveRow, Recent};
use crate::learn::run::demonstrated::Demonstrated;
use crate::learn::run::explorer::{ExplorerState, LastBatch};
use crate::learn::run::eyes::{EyesState, SightOf};
use crate::learn::run::inputs::Inputs;
use crate::learn::run::trainer::Rest;
use crate::learn::settings::train::TrainSettings;

/// The version of the format.
pub(crate) const VERSION: u32 = 1;

pub(crate) const STATE: &str = "state.json";
pub(crate) const NETWORKS: &str = "networks.safetensors";
pub(crate) const ENVIRONMENT: &str = "environment.json";
/// The networks of an actor that sees pictures beside one that sees the state.
pub(crate) const EYES: &str = "eyes.safetensors";
/// The states that something that sees pictures remembers.
pub(crate) const FRAMES: &str = "frames.bytes";

/// The state that all processes share, except the networks.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Saved {
    pub(super) version: u32,
    /// The run that the checkpoint belongs to.
    pub(super) run_id: u64,
    pub(super) settings: TrainSettings,
    pub(super) seed: u64,
    /// The number of processes.
    pub(super) num_ranks: usize,
    pub(super) counters: Counters,
    pub(super) recent: Recent,
    pub(super) rows: Vec<CurveRow>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) rest: Option<Rest>,
    pub(super) inputs: Inputs,
    pub(super) num_updates: u64,
    /// The demonstrated transitions in the buffer of each process.
    pub(super) demonstrated: Vec<Demonstrated>,
    /// The actor that sees pictures, in a run of one process.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) eyes: Option<EyesState>,
}

/// The state of one process, except its buffer.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Own<S> {
    pub(super) explorer: ExplorerState,
    /// `None` before the first step.
    pub(super) last_batch: Option<LastBatch>,
    pub(super) collector: CollectorSnapshot<S>,
}

pub(super) fn own_name(rank: usize) -> String {
    format!("rank-{rank}.json")
}

pub(super) fn buffer_name(rank: usize) -> String {
    format!("rank-{rank}.buffer")
}

pub(crate) fn checkpoint_path(folder: &Path, steps: u64) -> PathBuf {
    folder.join(format!("checkpoint-{steps:012}.zip"))
}

/// Returns the checkpoints of a folder, oldest first: the files with names that
/// [`Trainer::save`](crate::learn::Trainer::save) gives, whatever their contents.
///
/// # Errors
/// The errors of reading the folder.
pub fn checkpoints(folder: impl AsRef<Path>) -> io::Result<Vec<PathBuf>> {
    Ok(checkpoints_by_steps(folder.as_ref())?.into_values().collect())
}

/// Returns the checkpoints of a folder by their numbers of steps.
pub(super) fn checkpoints_by_steps(folder: &Path) -> io::Result<BTreeMap<u64, PathBuf>> {
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
pub(super) struct Header {
    pub(super) version: u32,
    pub(super) run_id: u64,
}

pub(super) fn parse(state: &[u8]) -> Result<Saved, String> {
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
        if let Some(eyes) = &self.eyes {
            check_counts([("states", eyes.frames), ("updates", eyes.num_updates)])?;
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
    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        let own: Self = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
        check_counts(own.explorer.counts())?;
        Ok(own)
    }
}

/// Checks that the policy of a checkpoint sees what that of the run sees.
pub(crate) fn check_sight(
    path: &Path,
    saved: Option<&SightOf>,
    own: Option<&SightOf>,
) -> Result<(), CheckpointError> {
    if saved == own {
        return Ok(());
    }
    let sees = saved.map_or_else(|| "no pictures".to_owned(), ToString::to_string);
    Err(CheckpointError::OtherSight { path: path.to_owned(), sees })
}

pub(crate) fn check_counts<const N: usize>(counts: [(&str, u64); N]) -> Result<(), String> {
    match counts.iter().find(|(_, count)| *count > MAX_COUNT) {
        Some((what, count)) => Err(format!("it counts {count} {what}")),
        None => Ok(()),
    }
}
