//! Writes the archives of checkpoints and data sets.

use std::fs::File;
use std::io::{self, BufWriter, Write};

use zip::{CompressionMethod, DateTime, ZipWriter, write::SimpleFileOptions, write::StreamWriter};

/// An archive being written: named parts that are not compressed.
pub(crate) struct Archive<'a>(ZipWriter<StreamWriter<Once<BufWriter<&'a mut File>>>>);

impl<'a> Archive<'a> {
    pub(crate) fn new(file: &'a mut File) -> Self {
        let writer = Once { writer: BufWriter::new(file), has_failed: false };
        Self(ZipWriter::new_stream(writer))
    }

    /// Begins the next part and returns its writer.
    pub(crate) fn part(&mut self, name: &str) -> io::Result<&mut impl Write> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            // A fixed time, so that equal parts have equal bytes.
            .last_modified_time(DateTime::DEFAULT)
            .large_file(true);
        self.0.start_file(name, options)?;
        Ok(&mut self.0)
    }

    pub(crate) fn finish(self) -> io::Result<()> {
        self.0.finish()?.into_inner().flush()
    }
}

/// A writer that returns its first error and then discards everything: an archive that is dropped
/// after an error still finishes, and would print the next error.
struct Once<W> {
    writer: W,
    has_failed: bool,
}

impl<W: Write> Write for Once<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if !self.has_failed {
            self.writer.write_all(bytes).inspect_err(|_| self.has_failed = true)?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.has_failed { Ok(()) } else { self.writer.flush() }
    }
}
