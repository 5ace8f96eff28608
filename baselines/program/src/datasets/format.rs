//! The formats of data sets.

use std::{
    fs::{self, File},
    io::Read,
    path::{Path, PathBuf},
};

use anyhow::Context;
use baselines::datasets::{DatasetError, DatasetWriter, Metadata, MinariWriter, OgBenchWriter};
use hmac_sha256::Hash;

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Minari's, with Arrow
    Minari,
    /// OGBench's
    Ogbench,
}

impl Format {
    pub const ALL: [Self; 2] = [Self::Minari, Self::Ogbench];

    /// Begins a data set in a folder of data sets.
    pub fn create(
        self,
        root: &Path,
        metadata: Metadata,
        snapshots: bool,
    ) -> Result<Box<dyn DatasetWriter>, DatasetError> {
        Ok(match self {
            Self::Minari if snapshots => {
                Box::new(MinariWriter::create(root, metadata)?.with_snapshots())
            }
            Self::Minari => Box::new(MinariWriter::create(root, metadata)?),
            Self::Ogbench => Box::new(OgBenchWriter::create(root, metadata)?),
        })
    }

    /// Returns the folder of the data sets of this format.
    pub fn root(self, out: &Path) -> PathBuf {
        out.join(match self {
            Self::Minari => "minari",
            Self::Ogbench => "ogbench",
        })
    }

    /// Returns the folder of a data set.
    pub fn folder(self, root: &Path, name: &str) -> PathBuf {
        match self {
            Self::Minari => root.join(name),
            Self::Ogbench => root.join(name.replace('/', "-")),
        }
    }
}

/// The contents of all files of a folder.
#[derive(Clone, Debug)]
pub struct Contents {
    pub bytes: u64,
    /// The first 16 digits of the SHA-256 of paths, lengths and contents.
    pub checksum: String,
}

impl Contents {
    pub fn of(folder: &Path) -> anyhow::Result<Self> {
        let (mut bytes, mut hash) = (0, Hash::new());
        // One part at a time, because files may be larger than memory.
        let mut part = vec![0; 1 << 20];
        for path in files(folder)? {
            let mut file = File::open(&path).with_context(|| path.display().to_string())?;
            let len = file.metadata()?.len();
            hash.update(path.strip_prefix(folder)?.to_string_lossy().as_bytes());
            hash.update(len.to_le_bytes());
            loop {
                let read = file.read(&mut part).with_context(|| path.display().to_string())?;
                if read == 0 {
                    break;
                }
                hash.update(&part[..read]);
            }
            bytes += len;
        }
        let hash = hash.finalize();
        let checksum = hash[..8].iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { bytes, checksum })
    }
}

/// Returns the files below a folder in the order of their paths.
fn files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut entries: Vec<_> = entries.collect::<anyhow::Result<_>>()?;
    entries.sort();
    let mut found = Vec::new();
    for path in entries {
        if path.is_dir() { found.extend(files(&path)?) } else { found.push(path) }
    }
    Ok(found)
}
