//! Reading checkpoints.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek};
use std::path::{Path, PathBuf};

use her_relabel::files;
use zip::read::ZipFile;
use zip::{CompressionMethod, ZipArchive};

use super::format::{
    ENVIRONMENT, EYES, FRAMES, Header, NETWORKS, STATE, Saved, buffer_name, checkpoint_path,
    checkpoints, own_name, parse,
};
use crate::learn::error::CheckpointError as Error;
use crate::workers::Workers;

/// The parts of a checkpoint that a process needs.
pub(super) struct Loaded {
    pub(super) path: PathBuf,
    /// The checkpoint before it; known only in the first process.
    pub(super) before: Option<PathBuf>,
    pub(super) saved: Saved,
    pub(super) networks: Vec<u8>,
    pub(super) environment: Vec<u8>,
    /// The networks and the memory of an actor that sees pictures; empty without one.
    pub(super) eyes: [Vec<u8>; 2],
    /// The state of the process; empty on a different number of processes.
    pub(super) own: Vec<u8>,
    /// The buffers, each with the process that wrote it.
    pub(super) buffers: Vec<(usize, Vec<u8>)>,
}

impl Loaded {
    /// Reads the last checkpoint of a folder in the first process, and sends each process what it
    /// needs.
    pub(super) fn read(folder: &Path, workers: &mut dyn Workers) -> Result<Self, Error> {
        let (rank, size) = (workers.rank(), workers.size());
        let mut file = if rank == 0 { Some(CheckpointFile::open(folder, size)?) } else { None };
        // Only the first process knows the file.
        let (opened, before) = match &file {
            Some(file) => (file.path.clone(), file.before.clone()),
            None => (folder.to_owned(), None),
        };
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
        let environment = send(workers, &|_| Some(ENVIRONMENT.to_owned()))?;
        let saved = parse(&state).map_err(|reason| Error::Damaged {
            path: opened,
            reason,
            before: before.clone(),
        })?;
        let num_ranks = saved.num_ranks;
        let mut of_eyes =
            |name: &str| send(workers, &|_| saved.eyes.is_some().then(|| name.to_owned()));
        let eyes = [of_eyes(EYES)?, of_eyes(FRAMES)?];
        let own = send(workers, &|rank| (num_ranks == size).then(|| own_name(rank)))?;
        // On a different number of processes, the buffers are distributed round-robin. With more
        // processes than buffers, several processes get the same one.
        let mut buffers = Vec::new();
        for round in 0..num_ranks.div_ceil(size) {
            let number = |rank: usize| match round * size + rank {
                number if size <= num_ranks => (number < num_ranks).then_some(number),
                number => Some(number % num_ranks),
            };
            let buffer = send(workers, &|rank| number(rank).map(buffer_name))?;
            buffers.extend(number(rank).map(|number| (number, buffer)));
        }
        let path = checkpoint_path(folder, saved.counters.steps);
        Ok(Self { path, before, saved, networks, environment, eyes, own, buffers })
    }
}

/// Reads the fields by which a checkpoint is recognized.
pub(super) fn header(path: &Path) -> io::Result<Header> {
    let mut archive = ZipArchive::new(BufReader::new(files::open(path)?))?;
    Ok(serde_json::from_reader(BufReader::new(entry(&mut archive, STATE)?))?)
}

/// Finds an entry; it is not compressed, so it takes no more memory than it takes of the file.
fn entry<'a, R: Read + Seek>(
    archive: &'a mut ZipArchive<R>,
    name: &str,
) -> io::Result<ZipFile<'a, R>> {
    let entry = archive.by_name(name)?;
    match entry.compression() {
        CompressionMethod::Stored => Ok(entry),
        _ => Err(io::Error::other(format!("{name} is compressed"))),
    }
}

/// The last checkpoint of a folder.
pub(crate) struct CheckpointFile {
    pub(crate) path: PathBuf,
    before: Option<PathBuf>,
    archive: ZipArchive<BufReader<File>>,
    /// The number of bytes of entries that may still be read.
    left: u64,
}

impl CheckpointFile {
    /// Opens the last checkpoint, to be read by `num_ranks` processes.
    pub(crate) fn open(folder: &Path, num_ranks: usize) -> Result<Self, Error> {
        let mut all = checkpoints(folder)
            .map_err(|source| Error::Read { path: folder.to_owned(), source })?;
        let path = all.pop().ok_or_else(|| Error::None { folder: folder.to_owned() })?;
        let before = all.pop();
        let read = |source| Error::Read { path: path.clone(), source };
        let file = files::open(&path).map_err(read)?;
        // Each process reads each entry at most once.
        let left = file.metadata().map_err(read)?.len().saturating_mul(num_ranks as u64);
        match ZipArchive::new(BufReader::new(file)) {
            Ok(archive) => Ok(Self { path, before, archive, left }),
            Err(error) => Err(Error::Damaged { path, reason: error.to_string(), before }),
        }
    }

    pub(crate) fn entry(&mut self, name: &str) -> Result<Vec<u8>, Error> {
        self.read(name).map_err(|error| self.damaged(error.to_string()))
    }

    fn read(&mut self, name: &str) -> io::Result<Vec<u8>> {
        let mut entry = entry(&mut self.archive, name)?;
        let left = self.left.checked_sub(entry.compressed_size());
        self.left = left.ok_or_else(|| io::Error::other("its entries are longer than the file"))?;
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    pub(crate) fn damaged(&self, reason: String) -> Error {
        Error::Damaged { path: self.path.clone(), reason, before: self.before.clone() }
    }
}
