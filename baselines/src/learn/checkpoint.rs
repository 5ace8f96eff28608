//! Checkpoints: everything that a run needs to continue exactly where it was.
//!
//! A checkpoint is a zip archive of `state.json`, `networks.safetensors` and `buffer`, each with a
//! checksum, none compressed. It is written under a temporary name and then renamed, so that a run
//! that is killed while it writes leaves the last checkpoint as it was.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write as _};
use std::path::{Path, PathBuf};

use fetch_env::{EnvError, SnapshotEnv};
use her_relabel::HerBuffer;
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

use super::curve::{Counters, CurveRow, Recent};
use super::error::CheckpointError as Error;
use super::explorer::{ExplorerState, LastBatch};
use super::inputs::Inputs;
use super::settings::TrainSettings;
use super::trainer::{LearnEnv, Trainer};
use crate::collector::CollectorSnapshot;
use crate::trained::file::{from_bytes, to_bytes};

/// The version of the format.
const VERSION: u32 = 1;

/// The number of checkpoints that stay in a folder.
const KEPT: usize = 2;

/// The name of a checkpoint that is being written.
const TEMPORARY: &str = "unfinished.zip";

const STATE: &str = "state.json";
const NETWORKS: &str = "networks.safetensors";
const BUFFER: &str = "buffer";

/// What is saved beside networks and buffer.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved<S> {
    version: u32,
    settings: TrainSettings,
    seed: u64,
    counters: Counters,
    recent: Recent,
    rows: Vec<CurveRow>,
    inputs: Inputs,
    explorer: ExplorerState,
    /// `None` before the first step.
    last_batch: Option<LastBatch>,
    collector: CollectorSnapshot<S>,
    num_updates: u64,
}

impl<E: LearnEnv + SnapshotEnv> Trainer<E> {
    /// Saves a checkpoint in a folder, makes the folder if there is none, and removes all but the
    /// last two checkpoints. Returns its path.
    ///
    /// # Errors
    /// [`CheckpointError`](Error). The earlier checkpoints are whole then.
    pub fn save(&mut self, folder: impl AsRef<Path>) -> Result<PathBuf, Error> {
        let folder = folder.as_ref();
        let path = folder.join(format!("checkpoint-{:012}.zip", self.counters.steps));
        let failed = |source| Error::Write { path: path.clone(), source };
        let collector = self.collector.snapshot().map_err(Error::Envs)?;
        let (num_updates, networks) = self.encode_networks().map_err(failed)?;
        let saved = Saved {
            version: VERSION,
            settings: self.settings.clone(),
            seed: self.seed,
            counters: self.counters,
            recent: self.recent,
            rows: self.rows.clone(),
            inputs: self.inputs.clone(),
            explorer: self.explorer.state().clone(),
            last_batch: (self.counters.steps > 0)
                .then(|| LastBatch::of(self.collector.envs().batch())),
            collector,
            num_updates,
        };
        let temporary = folder.join(TEMPORARY);
        let write = || -> io::Result<()> {
            fs::create_dir_all(folder)?;
            let mut archive = ZipWriter::new(BufWriter::new(File::create(&temporary)?));
            let options = SimpleFileOptions::default()
                .compression_method(CompressionMethod::Stored)
                .large_file(true);
            archive.start_file(STATE, options)?;
            archive.write_all(&serde_json::to_vec(&saved)?)?;
            archive.start_file(NETWORKS, options)?;
            archive.write_all(&networks)?;
            archive.start_file(BUFFER, options)?;
            self.buffer.write_to(&mut archive)?;
            let file = archive.finish()?.into_inner()?;
            file.sync_all()?;
            fs::rename(&temporary, &path)?;
            let all = checkpoints(folder)?;
            let stale = all.len().saturating_sub(KEPT);
            all[..stale].iter().try_for_each(fs::remove_file)
        };
        write().map_err(|source| {
            // A full disk has space again.
            let _ = fs::remove_file(&temporary);
            failed(source)
        })?;
        self.last_checkpoint = Some(path.clone());
        Ok(path)
    }

    /// Continues the run of the last checkpoint in a folder, on environments that `make` makes as
    /// those of the run were made. It ends with the same bits as a run that was never stopped.
    ///
    /// # Errors
    /// [`CheckpointError`](Error) if there is no checkpoint, or the last one is damaged or does not
    /// fit the environments.
    pub fn resume(
        make: impl Fn() -> Result<E, EnvError>,
        folder: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Self, Error> {
        let folder = folder.as_ref();
        let all = checkpoints(folder)
            .map_err(|source| Error::Read { path: folder.to_owned(), source })?;
        let path = all.last().ok_or_else(|| Error::None { folder: folder.to_owned() })?;
        let damaged = |reason: String| {
            let before = all.iter().rev().nth(1).cloned();
            Error::Damaged { path: path.clone(), reason, before }
        };
        let file = File::open(path).map_err(|source| Error::Read { path: path.clone(), source })?;
        let mut archive =
            ZipArchive::new(BufReader::new(file)).map_err(|error| damaged(error.to_string()))?;
        let state = entry(&mut archive, STATE).map_err(|error| damaged(error.to_string()))?;
        let saved: Saved<E::Snapshot> = parse(&state).map_err(damaged)?;
        let networks = entry(&mut archive, NETWORKS).map_err(|error| damaged(error.to_string()))?;
        let buffer = archive.by_name(BUFFER).map_err(|error| damaged(error.to_string()))?;
        let buffer = HerBuffer::read_from(BufReader::new(buffer))
            .map_err(|error| damaged(error.to_string()))?;

        let mut trainer = Self::new(make, saved.settings, saved.seed, num_threads)?;
        let foreign = |what| Error::Foreign { path: path.clone(), what };
        if buffer.config() != trainer.buffer.config() {
            return Err(foreign("the buffer"));
        }
        if !trainer.decode_networks(saved.num_updates, &networks).map_err(damaged)? {
            return Err(foreign("a network"));
        }
        let Inputs { observation, goal, .. } = &saved.inputs;
        let dims = buffer.config().dims();
        if (observation.dim(), goal.dim()) != (dims.observation, dims.goal) {
            return Err(foreign("a normalizer"));
        }
        trainer.collector.restore(&saved.collector).map_err(Error::Envs)?;
        if let Some(last_batch) = saved.last_batch
            && !trainer.explorer.restore(saved.explorer, last_batch)
        {
            return Err(foreign("the last batch"));
        }
        trainer.buffer = buffer;
        trainer.inputs = saved.inputs;
        if saved.counters.updates > 0 {
            let actor = trainer.algorithm.actor();
            trainer.explorer.set_actor(actor, trainer.inputs.clone());
        }
        trainer.counters = saved.counters;
        trainer.recent = saved.recent;
        trainer.rows = saved.rows;
        trainer.last_checkpoint = Some(path.clone());
        Ok(trainer)
    }

    /// Returns the number of updates, and the vectors of the algorithm's state as a file.
    fn encode_networks(&mut self) -> io::Result<(u64, Vec<u8>)> {
        let state = self.algorithm.state_mut();
        let vectors: Vec<_> = state
            .vectors
            .iter()
            .map(|(name, vector)| (name, vector.len(), to_bytes(vector)))
            .collect();
        let views = vectors.iter().map(|(name, len, bytes)| {
            TensorView::new(Dtype::F32, vec![*len], bytes).map(|view| (name.as_str(), view))
        });
        let views = views.collect::<Result<Vec<_>, _>>().map_err(io::Error::other)?;
        let file = safetensors::serialize(views, None).map_err(io::Error::other)?;
        Ok((*state.num_updates, file))
    }

    /// Replaces the vectors of the algorithm's state; `false` if they do not fit.
    fn decode_networks(&mut self, num_updates: u64, file: &[u8]) -> Result<bool, String> {
        let tensors = SafeTensors::deserialize(file).map_err(|error| error.to_string())?;
        let saved: BTreeMap<_, _> = tensors.iter().collect();
        let state = self.algorithm.state_mut();
        if saved.len() != state.vectors.len() {
            return Ok(false);
        }
        for (name, vector) in state.vectors {
            let Some(view) = saved
                .get(name.as_str())
                .filter(|view| view.dtype() == Dtype::F32 && view.data().len() == 4 * vector.len())
            else {
                return Ok(false);
            };
            vector.clear();
            vector.extend(from_bytes(view.data()));
        }
        *state.num_updates = num_updates;
        Ok(true)
    }
}

/// Returns the checkpoints of a folder, oldest first.
fn checkpoints(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if name.starts_with("checkpoint-") && name.ends_with(".zip") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

fn entry(archive: &mut ZipArchive<BufReader<File>>, name: &str) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    archive.by_name(name)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn parse<S: DeserializeOwned>(state: &[u8]) -> Result<Saved<S>, String> {
    let saved: Saved<S> = serde_json::from_slice(state).map_err(|error| error.to_string())?;
    match saved.version {
        VERSION => Ok(saved),
        version => Err(format!("it has version {version}, and this crate reads {VERSION}")),
    }
}
