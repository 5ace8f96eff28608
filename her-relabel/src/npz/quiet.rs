//! A writer that lets an archive fail without printing.

use std::cell::Cell;
use std::io::{self, Seek, SeekFrom, Write};

/// A writer that keeps its first error, and from then on accepts everything and writes nothing.
///
/// A dropped `ZipWriter` finishes its archive, and prints a failure to standard error. With this
/// writer nothing fails: the archive is finished, and [`check`](Self::check) returns the error.
pub(crate) struct Quiet<W> {
    /// `None` after an error.
    writer: Option<W>,
    error: Cell<Option<io::Error>>,
    /// The position, and the end of what is written, which go on as if nothing had failed.
    position: u64,
    end: u64,
}

impl<W: Write + Seek> Quiet<W> {
    pub(crate) fn new(mut writer: W) -> io::Result<Self> {
        let position = writer.stream_position()?;
        let end = writer.seek(SeekFrom::End(0))?;
        writer.seek(SeekFrom::Start(position))?;
        Ok(Self { writer: Some(writer), error: Cell::new(None), position, end })
    }

    /// Returns the first error, once.
    pub(crate) fn check(&self) -> io::Result<()> {
        self.error.take().map_or(Ok(()), Err)
    }

    fn attempt(&mut self, action: impl FnOnce(&mut W) -> io::Result<()>) {
        // Taken, so that a writer that panics is not called again either.
        if let Some(mut writer) = self.writer.take() {
            match action(&mut writer) {
                Ok(()) => self.writer = Some(writer),
                Err(error) => self.error.set(Some(error)),
            }
        }
    }
}

impl<W: Write + Seek> Write for Quiet<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.attempt(|writer| writer.write_all(bytes));
        self.position += bytes.len() as u64;
        self.end = self.end.max(self.position);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.attempt(Write::flush);
        Ok(())
    }
}

impl<W: Write + Seek> Seek for Quiet<W> {
    fn seek(&mut self, target: SeekFrom) -> io::Result<u64> {
        let position = match target {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::Current(offset) => self.position.checked_add_signed(offset),
            SeekFrom::End(offset) => self.end.checked_add_signed(offset),
        };
        self.position = position.ok_or(io::ErrorKind::InvalidInput)?;
        let start = SeekFrom::Start(self.position);
        self.attempt(|writer| writer.seek(start).map(drop));
        Ok(self.position)
    }

    fn stream_position(&mut self) -> io::Result<u64> {
        Ok(self.position)
    }
}
