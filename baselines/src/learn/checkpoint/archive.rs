//! Writing the archive of a checkpoint.

use std::fs::File;
use std::io::{self, BufWriter, Write};

use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions, write::StreamWriter};

/// An archive that is being written: parts that have names, and are not compressed.
pub(super) struct Archive<'a>(ZipWriter<StreamWriter<Once<BufWriter<&'a mut File>>>>);

impl<'a> Archive<'a> {
    pub(super) fn new(file: &'a mut File) -> Self {
        let writer = Once { writer: BufWriter::new(file), has_failed: false };
        Self(ZipWriter::new_stream(writer))
    }

    /// Begins the next part, and returns what it is written to.
    pub(super) fn part(&mut self, name: &str) -> io::Result<&mut impl Write> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(true);
        self.0.start_file(name, options)?;
        Ok(&mut self.0)
    }

    pub(super) fn finish(self) -> io::Result<()> {
        self.0.finish()?.into_inner().flush()
    }
}

/// A writer that returns one error, and then takes what comes without writing it: an archive that
/// is dropped after an error is finished all the same, and prints the next error.
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
