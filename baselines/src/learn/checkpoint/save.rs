//! Saving checkpoints.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use fetch_env::SnapshotEnv;
use her_relabel::files;

use super::environment::EnvMark;
use super::load::header;
use super::{
    ENVIRONMENT, Header, NETWORKS, Own, STATE, Saved, VERSION, buffer_name, checkpoint_path,
    checkpoints_by_steps, own_name,
};
use crate::archive::Archive;
use crate::learn::demonstrated::Demonstrated;
use crate::learn::env::LearnEnv;
use crate::learn::error::{CheckpointError as Error, TrainError};
use crate::learn::trainer::Trainer;
use crate::trained::file::to_bytes;
use crate::workers::{gather_values, sum};

/// The number of checkpoints that are kept in a folder.
const KEPT: usize = 2;

impl<E: LearnEnv + SnapshotEnv> Trainer<E> {
    /// Saves a checkpoint in a folder, which it creates if needed, and removes this run's older
    /// checkpoints except the last one. Returns its path. The first process writes, and
    /// all wait for it.
    ///
    /// A run is what [`new`](Self::new) began, with everything that was [resumed](Self::resume)
    /// from it. Equal settings and seeds do not make two runs the same. Only one trainer at a time
    /// may save checkpoints in a folder.
    ///
    /// # Errors
    /// [`CheckpointError::OtherRun`](Error::OtherRun) if the folder has checkpoints of another run,
    /// or an unreadable file in the place of this one; otherwise another
    /// [`CheckpointError`](Error). Earlier checkpoints stay whole.
    pub fn save(&mut self, folder: impl AsRef<Path>) -> Result<PathBuf, Error> {
        let folder = folder.as_ref();
        let path = checkpoint_path(folder, self.counters.steps);
        let failed = |source| Error::Write { path: path.clone(), source };
        let own = Own {
            explorer: self.collecting.explorer.state().clone(),
            last_batch: (self.counters.steps > 0).then(|| {
                self.collecting.explorer.last_batch(self.collecting.collector.envs().last_step())
            }),
            collector: self.collecting.collector.snapshot().map_err(Error::Envs)?,
        };
        let own = serde_json::to_vec(&own).map_err(|error| failed(error.into()))?;
        let is_first = self.workers.rank() == 0;
        let demonstrated = gather_values(&mut *self.workers, &self.replay.demonstrated)
            .map_err(TrainError::from)?;
        let others = self.gather_parts(&own).map_err(failed)?;
        let write = |trainer: &mut Self| trainer.write(folder, &path, demonstrated, &own, &others);
        let written = if is_first { write(self) } else { Ok(()) };
        let num_failed = sum(&mut *self.workers, u64::from(written.is_err()));
        written?;
        if num_failed.map_err(TrainError::from)? > 0 {
            return Err(failed(io::Error::other("the first process could not write it")));
        }
        self.last_checkpoint = Some(path.clone());
        Ok(path)
    }

    /// Returns the state and the buffer of each other process in the first process, and nothing in
    /// the others.
    fn gather_parts(&mut self, own: &[u8]) -> io::Result<Vec<[Vec<u8>; 2]>> {
        let (mut states, mut buffer) = (Vec::new(), Vec::new());
        if self.workers.rank() > 0 {
            states.extend_from_slice(own);
            self.replay.buffer.write_to(&mut buffer)?;
        }
        let states = self.workers.gather_first(states);
        let buffers = self.workers.gather_first(buffer);
        Ok(states.into_iter().zip(buffers).skip(1).map(|(state, buffer)| [state, buffer]).collect())
    }

    /// Writes a checkpoint and removes those that it makes obsolete.
    fn write(
        &mut self,
        folder: &Path,
        path: &Path,
        demonstrated: Vec<Demonstrated>,
        own: &[u8],
        others: &[[Vec<u8>; 2]],
    ) -> Result<(), Error> {
        let failed = |source| Error::Write { path: path.to_owned(), source };
        fs::create_dir_all(folder).map_err(failed)?;
        let older = self.older_checkpoints(folder, path)?;
        // What a killed process of this run has left.
        files::remove_unfinished(folder, &self.mark()).map_err(failed)?;
        self.write_archive(path, demonstrated, own, others).map_err(failed)?;
        let stale = older.len().saturating_sub(KEPT - 1);
        for path in &older[..stale] {
            match fs::remove_file(path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(error)),
                _ => {}
            }
        }
        Ok(())
    }

    /// Returns the mark of unfinished checkpoints, which only this run's have.
    fn mark(&self) -> String {
        format!("{:016x}", self.run_id)
    }

    /// Returns the checkpoints of this run in a folder that are older than the one at `path`,
    /// oldest first. One that cannot be read stays as it is.
    fn older_checkpoints(&self, folder: &Path, path: &Path) -> Result<Vec<PathBuf>, Error> {
        let mut older = Vec::new();
        let all = checkpoints_by_steps(folder)
            .map_err(|source| Error::Read { path: folder.to_owned(), source })?;
        for (steps, other) in all {
            match header(&other) {
                Ok(Header { version: VERSION, run_id }) if run_id == self.run_id => {
                    if steps < self.counters.steps {
                        older.push(other);
                    }
                }
                Err(_) if other != path => {}
                _ => return Err(Error::OtherRun { path: other }),
            }
        }
        Ok(older)
    }

    fn write_archive(
        &mut self,
        path: &Path,
        demonstrated: Vec<Demonstrated>,
        own: &[u8],
        others: &[[Vec<u8>; 2]],
    ) -> io::Result<()> {
        let (num_updates, networks) = self.encode_networks()?;
        let saved = Saved {
            version: VERSION,
            run_id: self.run_id,
            settings: self.settings.clone(),
            seed: self.seed,
            num_ranks: self.workers.size(),
            counters: self.counters,
            recent: self.recent,
            rows: self.rows.clone(),
            inputs: self.replay.inputs.clone(),
            num_updates,
            demonstrated,
        };
        let environment =
            EnvMark::of(&self.replay.template, self.replay.buffer.config().dims().goal);
        files::replace_marked(path, &self.mark(), |file| {
            let mut archive = Archive::new(file);
            archive.part(STATE)?.write_all(&serde_json::to_vec(&saved)?)?;
            archive.part(NETWORKS)?.write_all(&networks)?;
            archive.part(ENVIRONMENT)?.write_all(&serde_json::to_vec(&environment)?)?;
            archive.part(&own_name(0))?.write_all(own)?;
            self.replay.buffer.write_to(archive.part(&buffer_name(0))?)?;
            for (rank, [state, buffer]) in (1..).zip(others) {
                archive.part(&own_name(rank))?.write_all(state)?;
                archive.part(&buffer_name(rank))?.write_all(buffer)?;
            }
            archive.finish()
        })
    }

    /// Returns the number of updates, and the vectors of the algorithm's state as a file.
    fn encode_networks(&mut self) -> io::Result<(u64, Vec<u8>)> {
        let state = self.learner.algorithm.state_mut();
        let vectors = state.vectors.into_iter();
        let tensors = vectors.map(|(name, vector)| (name, vec![vector.len()], vector.as_slice()));
        let file = to_bytes(tensors.collect(), None).map_err(io::Error::other)?;
        Ok((*state.num_updates, file))
    }
}
