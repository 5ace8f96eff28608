//! Saving checkpoints.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

use fetch_env::SnapshotEnv;
use safetensors::{Dtype, tensor::TensorView};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use super::{
    NETWORKS, Own, STATE, Saved, VERSION, buffer_name, checkpoint_path, checkpoints, own_name,
};
use crate::learn::error::{CheckpointError as Error, TrainError};
use crate::learn::trainer::{LearnEnv, Trainer};
use crate::trained::file::to_bytes;
use crate::workers::sum;

/// The number of checkpoints that stay in a folder.
const KEPT: usize = 2;

/// The name of a checkpoint that is being written.
const TEMPORARY: &str = "unfinished.zip";

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
                .then(|| self.explorer.last_batch(self.collector.envs().batch())),
            collector: self.collector.snapshot().map_err(Error::Envs)?,
        };
        let own = serde_json::to_vec(&own).map_err(|error| failed(error.into()))?;
        let is_first = self.workers.rank() == 0;
        let others = self.gather_parts(&own).map_err(failed)?;
        let written = if is_first { self.write(folder, &path, &own, &others) } else { Ok(()) };
        let num_failed = sum(&mut *self.workers, u64::from(written.is_err()));
        written.map_err(failed)?;
        if num_failed.map_err(TrainError::from)? > 0 {
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
}
