//! Reading checkpoints.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use zip::ZipArchive;

use super::{NETWORKS, STATE, Saved, buffer_name, checkpoint_path, checkpoints, own_name, parse};
use crate::learn::error::CheckpointError as Error;
use crate::workers::Workers;

/// What a process needs of a checkpoint.
pub(super) struct Loaded {
    pub(super) path: PathBuf,
    /// The checkpoint before it, where the folder is known.
    pub(super) before: Option<PathBuf>,
    pub(super) saved: Saved,
    pub(super) networks: Vec<u8>,
    /// What the process had for itself; empty on another number of processes.
    pub(super) own: Vec<u8>,
    pub(super) buffers: Vec<Vec<u8>>,
}

impl Loaded {
    /// Reads the last checkpoint of a folder in the first process, and sends each what it needs.
    pub(super) fn read(folder: &Path, workers: &mut dyn Workers) -> Result<Self, Error> {
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
