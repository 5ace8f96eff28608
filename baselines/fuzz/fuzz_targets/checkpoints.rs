//! Almost valid checkpoints are rejected, or their runs continue.
#![no_main]

mod small;

use std::{
    fs,
    io::{Cursor, Read, Write},
    sync::LazyLock,
};

use arbitrary::Arbitrary;
use baselines::learn::Trainer;
use libfuzzer_sys::fuzz_target;
use serde_json::Value;
use small::{Algorithm, make, settings, train};
use tempfile::tempdir;
use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

/// A checkpoint: the name of its file, and its entries.
struct Checkpoint {
    name: String,
    entries: Vec<(String, Vec<u8>)>,
}

/// A change to an entry, whose checksum in the archive then fits, or to the whole archive.
#[derive(Arbitrary, Debug)]
enum Change {
    Bytes {
        entry: u8,
        bytes: Vec<(u32, u8)>,
        /// Whether the checksum at the entry's end fits, too.
        is_sealed: bool,
    },
    /// A number of a tensor, counted from the last one.
    Number {
        entry: u8,
        at: u16,
        number: f32,
    },
    Json {
        entry: u8,
        edit: testing::Input,
    },
    /// An entry has the contents of another.
    Copied {
        entry: u8,
        from: u8,
    },
    Missing {
        entry: u8,
    },
    Archive(Vec<(u32, u8)>),
    Cut(u32),
}

/// The checkpoints of a run of each algorithm, in the middle of an episode.
static VALID: LazyLock<[Checkpoint; 2]> =
    LazyLock::new(|| [Algorithm::Ddpg, Algorithm::Sac].map(checkpoint));

fn checkpoint(algorithm: Algorithm) -> Checkpoint {
    let folder = tempdir().expect("a folder");
    let mut trainer = Trainer::new(make, settings(algorithm), 0, 1).expect("valid settings");
    train(&mut trainer).expect("a run");
    train(&mut trainer).expect("a run");
    let path = trainer.save(folder.path()).expect("a checkpoint");
    let name = path.file_name().expect("a name").to_string_lossy().into_owned();
    let bytes = fs::read(path).expect("a file");
    let mut archive = ZipArchive::new(Cursor::new(bytes)).expect("an archive");
    let entries = (0..archive.len()).map(|index| {
        let mut entry = archive.by_index(index).expect("an entry");
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).expect("its bytes");
        (entry.name().expect("a name").into_owned(), bytes)
    });
    let entries = entries.collect();
    Checkpoint { name, entries }
}

/// Replaces the bytes at these places, modulo the length.
fn replace(bytes: &mut [u8], changes: &[(u32, u8)]) {
    let len = bytes.len();
    for (at, byte) in changes.iter().filter(|_| len > 0) {
        bytes[*at as usize % len] = *byte;
    }
}

impl Change {
    /// Changes an entry.
    fn apply(&self, entries: &mut Vec<(String, Vec<u8>)>) {
        let len = entries.len();
        let (Self::Bytes { entry, .. }
        | Self::Number { entry, .. }
        | Self::Json { entry, .. }
        | Self::Copied { entry, .. }
        | Self::Missing { entry }) = self
        else {
            return;
        };
        let index = usize::from(*entry) % len.max(1);
        if len == 0 {
            return;
        }
        match self {
            Self::Bytes { bytes: changes, is_sealed, .. } => {
                let bytes = &mut entries[index].1;
                replace(bytes, changes);
                if let (true, Some((contents, checksum))) =
                    (is_sealed, bytes.split_last_chunk_mut())
                {
                    *checksum = crc32fast::hash(contents).to_le_bytes();
                }
            }
            Self::Number { at, number, .. } => {
                let bytes = &mut entries[index].1;
                let start = bytes.len() % 4;
                let (numbers, _) = bytes[start..].as_chunks_mut();
                let count = numbers.len().max(1);
                if let Some(place) = numbers.iter_mut().rev().nth(usize::from(*at) % count) {
                    *place = number.to_le_bytes();
                }
            }
            Self::Json { edit, .. } => {
                let value = serde_json::from_slice::<Value>(&entries[index].1);
                if let Some(changed) = value.ok().and_then(|value| edit.apply(&value)) {
                    entries[index].1 = changed.to_string().into_bytes();
                }
            }
            Self::Copied { from, .. } => {
                let from = entries[usize::from(*from) % len].1.clone();
                entries[index].1 = from;
            }
            Self::Missing { .. } => drop(entries.remove(index)),
            Self::Archive(_) | Self::Cut(_) => {}
        }
    }

    /// Changes the archive.
    fn apply_to_archive(&self, archive: &mut Vec<u8>) {
        match self {
            Self::Archive(changes) => replace(archive, changes),
            Self::Cut(len) => archive.truncate(*len as usize % (archive.len() + 1)),
            _ => {}
        }
    }
}

fuzz_target!(|input: (Algorithm, Vec<Change>)| {
    let (algorithm, changes) = input;
    let Checkpoint { name, entries } = &VALID[algorithm as usize];
    let mut entries = entries.clone();
    changes.iter().for_each(|change| change.apply(&mut entries));
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, bytes) in &entries {
        archive.start_file(name, options).expect("a new name");
        archive.write_all(bytes).expect("memory takes everything");
    }
    let mut archive = archive.finish().expect("memory takes everything").into_inner();
    changes.iter().for_each(|change| change.apply_to_archive(&mut archive));
    let folder = tempdir().expect("a folder");
    fs::write(folder.path().join(name), archive).expect("a file");
    let Ok(mut trainer) = Trainer::resume(make, folder.path(), 1) else { return };
    // What was accepted once is accepted again.
    trainer.save(folder.path()).expect("a checkpoint");
    let mut again = Trainer::resume(make, folder.path(), 1).expect("its own checkpoint");
    // A run may end in an error because its numbers, though in range, cannot be learned from.
    if train(&mut trainer).is_ok() {
        train(&mut again).expect("the same run");
        assert_eq!(
            trainer.rows().last().map(|row| row.final_distance_mean),
            again.rows().last().map(|row| row.final_distance_mean)
        );
    }
});
