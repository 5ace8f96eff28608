//! Writing and reading the numbers of a saved buffer, with a checksum; and the error of loading.

use std::io::{self, Read, Write};

use thiserror::Error;

use crate::scalar::Scalar;
use crate::store::config::ConfigError;

/// The versions of the file format: without and with a description of the task.
pub(crate) const VERSIONS: [u32; 2] = [2, 3];

/// The number of elements converted at a time, which bounds the memory that a wrong length can
/// claim.
const CHUNK: usize = 1 << 12;

/// The writer of a buffer, with the checksum so far.
pub(crate) struct Target<W> {
    writer: W,
    checksum: crc32fast::Hasher,
    bytes: Vec<u8>,
}

impl<W: Write> Target<W> {
    pub(crate) fn new(writer: W) -> Self {
        Self { writer, checksum: crc32fast::Hasher::new(), bytes: Vec::new() }
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.checksum.update(bytes);
        self.writer.write_all(bytes)
    }

    pub(crate) fn number(&mut self, number: u64) -> io::Result<()> {
        self.bytes(&number.to_le_bytes())
    }

    pub(crate) fn numbers<const N: usize>(&mut self, numbers: [u64; N]) -> io::Result<()> {
        numbers.into_iter().try_for_each(|number| self.number(number))
    }

    pub(crate) fn elements<T: Scalar>(&mut self, elements: &[T]) -> io::Result<()> {
        for chunk in elements.chunks(CHUNK) {
            self.bytes.clear();
            for element in chunk {
                self.bytes.extend_from_slice(&element.bits().to_le_bytes()[..size_of::<T>()]);
            }
            self.checksum.update(&self.bytes);
            self.writer.write_all(&self.bytes)?;
        }
        Ok(())
    }

    /// Writes the checksum.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        let checksum = self.checksum.finalize();
        self.writer.write_all(&checksum.to_le_bytes())?;
        self.writer.flush()
    }
}

/// The reader of a buffer, with the checksum so far.
pub(crate) struct Source<R> {
    reader: R,
    checksum: crc32fast::Hasher,
    bytes: Vec<u8>,
}

impl<R: Read> Source<R> {
    pub(crate) fn new(reader: R) -> Self {
        Self { reader, checksum: crc32fast::Hasher::new(), bytes: Vec::new() }
    }

    pub(crate) fn bytes<const N: usize>(&mut self) -> Result<[u8; N], LoadError> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    fn fill(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.reader.read_exact(bytes)?;
        self.checksum.update(bytes);
        Ok(())
    }

    pub(crate) fn number(&mut self) -> Result<u64, LoadError> {
        Ok(u64::from_le_bytes(self.bytes()?))
    }

    /// Reads the length of a text, at most `most` bytes, and the text.
    pub(crate) fn text(&mut self, most: usize) -> Result<String, LoadError> {
        let [len] = self.sizes()?;
        if len > most {
            return Err(LoadError::Damaged);
        }
        let mut bytes = vec![0; len];
        self.fill(&mut bytes)?;
        String::from_utf8(bytes).map_err(|_| LoadError::Damaged)
    }

    /// Reads numbers that must fit into a `usize`.
    pub(crate) fn sizes<const N: usize>(&mut self) -> Result<[usize; N], LoadError> {
        let mut sizes = [0; N];
        for size in &mut sizes {
            *size = usize::try_from(self.number()?).map_err(|_| LoadError::Damaged)?;
        }
        Ok(sizes)
    }

    /// Replaces `elements` with the next `len` elements, all of which must be finite.
    pub(crate) fn elements<T: Scalar>(
        &mut self,
        len: usize,
        elements: &mut Vec<T>,
    ) -> Result<(), LoadError> {
        elements.clear();
        while elements.len() < len {
            let count = CHUNK.min(len - elements.len());
            self.bytes.resize(count * size_of::<T>(), 0);
            self.reader.read_exact(&mut self.bytes)?;
            self.checksum.update(&self.bytes);
            for bytes in self.bytes.chunks_exact(size_of::<T>()) {
                let mut word = [0; 8];
                word[..bytes.len()].copy_from_slice(bytes);
                let element = T::from_bits(u64::from_le_bytes(word));
                if !element.to_f64().is_finite() {
                    return Err(LoadError::Damaged);
                }
                elements.push(element);
            }
        }
        Ok(())
    }

    /// Checks the checksum, which must be the end.
    pub(crate) fn finish(mut self) -> Result<(), LoadError> {
        let expected = self.checksum.clone().finalize();
        let is_whole = u32::from_le_bytes(self.bytes()?) == expected;
        let is_end = self.reader.read(&mut [0])? == 0;
        if is_whole && is_end { Ok(()) } else { Err(LoadError::Damaged) }
    }
}

/// Error returned when a buffer cannot be loaded.
#[derive(Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The file cannot be read.
    #[error("the buffer cannot be read: {0}")]
    Io(#[source] io::Error),
    /// The file is not a saved buffer.
    #[error("this is not a saved replay buffer: pass a file to which one was saved")]
    Foreign,
    /// The file was written by another version of this crate.
    #[error(
        "the buffer was saved in format {version} instead of {} or {}: load it with the version of \
         her-relabel that saved it",
        VERSIONS[0],
        VERSIONS[1]
    )]
    Version {
        /// The version of the file's format.
        version: u32,
    },
    /// The buffer was saved with elements of the other type.
    #[error(
        "the buffer has elements of {actual} bytes instead of {expected}: load it as \
         HerBuffer<f32> for 4 and HerBuffer<f64> for 8"
    )]
    ElementSize {
        /// The requested size, in bytes.
        expected: usize,
        /// The size in the file.
        actual: u32,
    },
    /// The file ends too early.
    #[error("the file ends before the buffer does: copy it again, as a whole")]
    Truncated,
    /// The contents differ from what was saved.
    #[error("the file is damaged: use an older copy")]
    Damaged,
    /// The file holds settings that no buffer can have.
    #[error("the file is damaged, use an older copy: {0}")]
    Config(#[from] ConfigError),
}
debug_as_display!(LoadError);

impl From<io::Error> for LoadError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::Truncated,
            _ => Self::Io(error),
        }
    }
}
