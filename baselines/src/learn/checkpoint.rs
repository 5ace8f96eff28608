//! Checkpoints: everything that a run needs to continue exactly where it was.
//!
//! A checkpoint is a zip archive of `state.json` and `networks.safetensors`, and of `rank-0.json` and
//! `rank-0.buffer` for each process, each with a checksum, none compressed. The first process writes
//! it, under a temporary name, and then renames it, so that a run that is killed while it writes
//! leaves the last checkpoint as it was.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write as _};
use std::path::{Path, PathBuf};

use fetch_env::{EnvError, SnapshotEnv};
use her_relabel::HerBuffer;
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
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
use crate::workers::{OneProcess, Workers, sum};

/// The version of the format.
const VERSION: u32 = 2;

/// The number of checkpoints that stay in a folder.
const KEPT: usize = 2;

/// The name of a checkpoint that is being written.
const TEMPORARY: &str = "unfinished.zip";

const STATE: &str = "state.json";
const NETWORKS: &str = "networks.safetensors";

/// What all processes have in common, beside the networks.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    version: u32,
    settings: TrainSettings,
    seed: u64,
    /// The number of processes.
    num_ranks: usize,
    counters: Counters,
    recent: Recent,
    rows: Vec<CurveRow>,
    inputs: Inputs,
    num_updates: u64,
}

/// What a process has for itself, beside its buffer.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Own<S> {
    explorer: ExplorerState,
    /// `None` before the first step.
    last_batch: Option<LastBatch>,
    collector: CollectorSnapshot<S>,
}

/// How a run continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Resumed {
    /// With the bits of a run that was never stopped.
    Exactly,
    /// On another number of processes. Networks, optimizers, normalizers, counters and finished
    /// episodes are those of the checkpoint. Unfinished episodes are lost, the environments begin
    /// others, and all following random numbers are others.
    OnOtherRanks {
        /// The number of processes that wrote the checkpoint.
        before: usize,
    },
}

impl<E: LearnEnv + SnapshotEnv> Trainer<E> {
    /// Saves a checkpoint in a folder, makes the folder if there is none, and removes all but the
    /// last two checkpoints. Returns its path. The first process writes, and all wait for it.
    ///
    /// # Errors
    /// [`CheckpointError`](Error). The earlier checkpoints are whole then.
    pub fn save(&mut self, folder: impl AsRef<Path>) -> Result<PathBuf, Error> {
        let folder = folder.as_ref();
        let path = checkpoint_path(folder, self.counters.steps);
        let failed = |source| Error::Write { path: path.clone(), source };
        let own = Own {
            explorer: self.explorer.state().clone(),
            last_batch: (self.counters.steps > 0)
                .then(|| LastBatch::of(self.collector.envs().batch())),
            collector: self.collector.snapshot().map_err(Error::Envs)?,
        };
        let own = serde_json::to_vec(&own).map_err(|error| failed(error.into()))?;
        let is_first = self.workers.rank() == 0;
        let others = self.gather_parts(&own).map_err(failed)?;
        let written = if is_first { self.write(folder, &path, &own, &others) } else { Ok(()) };
        let num_failed = sum(&mut *self.workers, u64::from(written.is_err()));
        written.map_err(failed)?;
        if num_failed > 0 {
            return Err(failed(io::Error::other("the first process could not write it")));
        }
        self.last_checkpoint = Some(path.clone());
        Ok(path)
    }

    /// Returns the state and the buffer of each other process in the first one, and nothing in the
    /// others.
    fn gather_parts(&mut self, own: &[u8]) -> io::Result<Vec<[Vec<u8>; 2]>> {
        let (mut states, mut buffer) = (Vec::new(), Vec::new());
        if self.workers.rank() > 0 {
            states.extend_from_slice(own);
            self.buffer.write_to(&mut buffer)?;
        }
        let states = self.workers.gather_first(states);
        let buffers = self.workers.gather_first(buffer);
        Ok(states.into_iter().zip(buffers).skip(1).map(|(state, buffer)| [state, buffer]).collect())
    }

    fn write(
        &mut self,
        folder: &Path,
        path: &Path,
        own: &[u8],
        others: &[[Vec<u8>; 2]],
    ) -> io::Result<()> {
        let (num_updates, networks) = self.encode_networks()?;
        let saved = Saved {
            version: VERSION,
            settings: self.settings.clone(),
            seed: self.seed,
            num_ranks: self.workers.size(),
            counters: self.counters,
            recent: self.recent,
            rows: self.rows.clone(),
            inputs: self.inputs.clone(),
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
            archive.start_file(own_name(0), options)?;
            archive.write_all(own)?;
            archive.start_file(buffer_name(0), options)?;
            self.buffer.write_to(&mut archive)?;
            for (rank, [state, buffer]) in (1..).zip(others) {
                archive.start_file(own_name(rank), options)?;
                archive.write_all(state)?;
                archive.start_file(buffer_name(rank), options)?;
                archive.write_all(buffer)?;
            }
            let file = archive.finish()?.into_inner()?;
            file.sync_all()?;
            fs::rename(&temporary, path)?;
            let all = checkpoints(folder)?;
            let stale = all.len().saturating_sub(KEPT);
            all[..stale].iter().try_for_each(fs::remove_file)
        };
        write().inspect_err(|_| {
            // A full disk has space again.
            let _ = fs::remove_file(&temporary);
        })
    }

    /// Continues the run of the last checkpoint in a folder, on environments that `make` makes as
    /// those of the run were made. It ends with the same bits as a run that was never stopped.
    ///
    /// # Errors
    /// [`CheckpointError`](Error) if there is no checkpoint, or the last one is damaged, of several
    /// processes, or does not fit the environments.
    pub fn resume(
        make: impl Fn() -> Result<E, EnvError>,
        folder: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Self, Error> {
        let workers = Box::new(OneProcess);
        Self::resume_with_workers(make, folder, num_threads, workers).map(|(trainer, _)| trainer)
    }

    /// Continues a run as [`resume`](Self::resume) does, shared by several processes, and says
    /// whether it does so exactly: on as many processes as wrote the checkpoint. The first process
    /// reads it.
    ///
    /// # Errors
    /// [`CheckpointError`](Error) as [`resume`](Self::resume).
    pub fn resume_with_workers(
        make: impl Fn() -> Result<E, EnvError>,
        folder: impl AsRef<Path>,
        num_threads: usize,
        mut workers: Box<dyn Workers>,
    ) -> Result<(Self, Resumed), Error> {
        let Loaded { path, before, saved, networks, own, buffers } =
            Loaded::read(folder.as_ref(), &mut *workers)?;
        let damaged = |reason: String| {
            let (path, before) = (path.clone(), before.clone());
            Error::Damaged { path, reason, before }
        };
        let foreign = |what| Error::Foreign { path: path.clone(), what };
        let size = workers.size();
        let mut trainer =
            Self::with_workers(make, saved.settings, saved.seed, num_threads, workers)?;
        let read = |bytes: &Vec<u8>| HerBuffer::read_from(bytes.as_slice());
        let mut buffers = buffers.iter().map(read).collect::<Result<Vec<_>, _>>();
        let buffers = buffers.as_mut().map_err(|error| damaged(error.to_string()))?;
        if !trainer.decode_networks(saved.num_updates, &networks).map_err(damaged)? {
            return Err(foreign("a network"));
        }
        let Inputs { observation, goal, .. } = &saved.inputs;
        let dims = trainer.buffer.config().dims();
        if (observation.dim(), goal.dim()) != (dims.observation, dims.goal) {
            return Err(foreign("a normalizer"));
        }
        trainer.inputs = saved.inputs;
        trainer.counters = saved.counters;
        trainer.recent = saved.recent;
        trainer.rows = saved.rows;
        trainer.last_checkpoint = Some(path.clone());
        let resumed = if saved.num_ranks == size {
            let own: Own<E::Snapshot> =
                serde_json::from_slice(&own).map_err(|error| damaged(error.to_string()))?;
            let buffer = buffers.pop().ok_or_else(|| damaged("it has no buffer".to_owned()))?;
            if buffer.config() != trainer.buffer.config() {
                return Err(foreign("the buffer"));
            }
            trainer.buffer = buffer;
            trainer.collector.restore(&own.collector).map_err(Error::Envs)?;
            if let Some(last_batch) = own.last_batch
                && !trainer.explorer.restore(own.explorer, last_batch)
            {
                return Err(foreign("the last batch"));
            }
            Resumed::Exactly
        } else {
            for buffer in buffers {
                trainer.buffer.append(buffer).map_err(|_| foreign("the buffer"))?;
            }
            let Counters { steps, episodes, .. } = trainer.counters;
            trainer.explorer.skip(steps, episodes);
            trainer.begin_episodes()?;
            Resumed::OnOtherRanks { before: saved.num_ranks }
        };
        if trainer.counters.updates > 0 {
            let actor = trainer.algorithm.actor();
            trainer.explorer.set_actor(actor, trainer.inputs.clone());
        }
        Ok((trainer, resumed))
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

/// What a process needs of a checkpoint.
struct Loaded {
    path: PathBuf,
    /// The checkpoint before it, where the folder is known.
    before: Option<PathBuf>,
    saved: Saved,
    networks: Vec<u8>,
    /// What the process had for itself; empty on another number of processes.
    own: Vec<u8>,
    buffers: Vec<Vec<u8>>,
}

impl Loaded {
    /// Reads the last checkpoint of a folder in the first process, and sends each what it needs.
    fn read(folder: &Path, workers: &mut dyn Workers) -> Result<Self, Error> {
        let (rank, size) = (workers.rank(), workers.size());
        let mut file = if rank == 0 { Some(CheckpointFile::open(folder)?) } else { None };
        let mut send = |workers: &mut dyn Workers, name: &dyn Fn(usize) -> Option<String>| {
            let mut messages = vec![Vec::new(); size];
            if let Some(file) = &mut file {
                for (rank, message) in messages.iter_mut().enumerate() {
                    if let Some(name) = name(rank) {
                        *message = file.entry(&name)?;
                    }
                }
            }
            Ok::<_, Error>(workers.exchange(messages).swap_remove(0))
        };
        let state = send(workers, &|_| Some(STATE.to_owned()))?;
        let networks = send(workers, &|_| Some(NETWORKS.to_owned()))?;
        let saved = parse(&state).map_err(|reason| Error::Damaged {
            path: folder.to_owned(),
            reason,
            before: None,
        })?;
        let num_ranks = saved.num_ranks;
        let own = send(workers, &|rank| (num_ranks == size).then(|| own_name(rank)))?;
        // On another number of processes, the buffers are dealt out in turn; on more, some twice.
        let mut buffers = Vec::new();
        for round in 0..num_ranks.div_ceil(size) {
            let number = |rank: usize| match round * size + rank {
                number if size <= num_ranks => (number < num_ranks).then_some(number),
                number => Some(number % num_ranks),
            };
            let buffer = send(workers, &|rank| number(rank).map(buffer_name))?;
            buffers.extend(number(rank).map(|_| buffer));
        }
        let path = checkpoint_path(folder, saved.counters.steps);
        let before = file.and_then(|file| file.before);
        Ok(Self { path, before, saved, networks, own, buffers })
    }
}

/// The last checkpoint of a folder.
struct CheckpointFile {
    path: PathBuf,
    before: Option<PathBuf>,
    archive: ZipArchive<BufReader<File>>,
}

impl CheckpointFile {
    fn open(folder: &Path) -> Result<Self, Error> {
        let mut all = checkpoints(folder)
            .map_err(|source| Error::Read { path: folder.to_owned(), source })?;
        let path = all.pop().ok_or_else(|| Error::None { folder: folder.to_owned() })?;
        let before = all.pop();
        let file =
            File::open(&path).map_err(|source| Error::Read { path: path.clone(), source })?;
        match ZipArchive::new(BufReader::new(file)) {
            Ok(archive) => Ok(Self { path, before, archive }),
            Err(error) => Err(Error::Damaged { path, reason: error.to_string(), before }),
        }
    }

    fn entry(&mut self, name: &str) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        let read = self.archive.by_name(name).map_err(io::Error::from);
        match read.and_then(|mut entry| entry.read_to_end(&mut bytes)) {
            Ok(_) => Ok(bytes),
            Err(error) => Err(self.damaged(error.to_string())),
        }
    }

    fn damaged(&self, reason: String) -> Error {
        Error::Damaged { path: self.path.clone(), reason, before: self.before.clone() }
    }
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

#[derive(Deserialize)]
struct Version {
    version: u32,
}

fn parse(state: &[u8]) -> Result<Saved, String> {
    let read = |error: serde_json::Error| error.to_string();
    match serde_json::from_slice(state).map_err(read)? {
        Version { version: VERSION } => {}
        Version { version } => {
            return Err(format!("it has version {version}, and this crate reads {VERSION}"));
        }
    }
    let saved: Saved = serde_json::from_slice(state).map_err(read)?;
    if saved.num_ranks == 0 { Err("it is of no process".to_owned()) } else { Ok(saved) }
}
