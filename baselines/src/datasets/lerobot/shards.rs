//! A table in Parquet files.

use std::fs::{self, File};
use std::io;
use std::path::PathBuf;

use arrow_array::RecordBatch;
use parquet::arrow::ArrowWriter;
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};

use crate::datasets::error::DatasetError;

/// The number of files in a folder, by LeRobot's numbering.
pub(super) const FILES_OF_CHUNK: i64 = 1000;
/// The size of the rows that are kept in memory, in bytes.
const ROW_GROUP: usize = 4 << 20;

/// Which file a row is in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shard {
    pub(super) chunk: i64,
    pub(super) file: i64,
}

/// A growing table, in the files `chunk-000/file-000.parquet` and those that follow.
#[derive(Debug)]
pub(super) struct Shards {
    folder: PathBuf,
    /// The size from which a file is full, in bytes.
    file_size: usize,
    shard: Shard,
    writer: Option<Table>,
}

/// A file to which rows are added.
#[derive(Debug)]
pub(super) struct Table {
    path: PathBuf,
    writer: ArrowWriter<File>,
}

impl Shards {
    pub(super) const fn new(folder: PathBuf, file_size: usize) -> Self {
        Self { folder, file_size, shard: Shard { chunk: 0, file: 0 }, writer: None }
    }

    /// Returns where the next rows will be.
    pub(super) fn next(&mut self) -> Result<Shard, DatasetError> {
        if self.writer.as_ref().is_some_and(|table| table.size() >= self.file_size) {
            self.close()?;
            let Shard { chunk, file } = self.shard;
            self.shard = match file + 1 {
                FILES_OF_CHUNK => Shard { chunk: chunk + 1, file: 0 },
                file => Shard { chunk, file },
            };
        }
        Ok(self.shard)
    }

    /// Adds rows.
    pub(super) fn write(&mut self, table: &RecordBatch) -> Result<(), DatasetError> {
        let writer = match &mut self.writer {
            Some(writer) => writer,
            none => {
                let Shard { chunk, file } = self.shard;
                let folder = self.folder.join(format!("chunk-{chunk:03}"));
                fs::create_dir_all(&folder).map_err(DatasetError::file(&folder))?;
                none.insert(Table::create(folder.join(format!("file-{file:03}.parquet")), table)?)
            }
        };
        writer.write(table)
    }

    pub(super) fn close(&mut self) -> Result<(), DatasetError> {
        if let Some(writer) = self.writer.take() {
            writer.close()?;
        }
        Ok(())
    }
}

impl Table {
    /// Creates a file for rows with the schema of `table`.
    pub(super) fn create(path: PathBuf, table: &RecordBatch) -> Result<Self, DatasetError> {
        let file = File::create_new(&path).map_err(DatasetError::file(&path))?;
        let properties = WriterProperties::builder()
            .set_max_row_group_row_count(None)
            .set_max_row_group_bytes(Some(ROW_GROUP))
            .set_statistics_enabled(EnabledStatistics::Chunk);
        let writer = ArrowWriter::try_new(file, table.schema(), Some(properties.build()))?;
        Ok(Self { path, writer })
    }

    /// Returns the size that the file will have at least, in bytes.
    fn size(&self) -> usize {
        self.writer.bytes_written() + self.writer.in_progress_size()
    }

    /// Adds rows.
    pub(super) fn write(&mut self, table: &RecordBatch) -> Result<(), DatasetError> {
        self.writer.write(table).map_err(|error| DatasetError::file(&self.path)(io_error(error)))
    }

    /// Writes the rows that are still in memory, and the end of the file.
    pub(super) fn close(self) -> Result<(), DatasetError> {
        let closed = self.writer.close();
        closed.map(drop).map_err(|error| DatasetError::file(&self.path)(io_error(error)))
    }
}

/// Returns the error of the file system that an error of Parquet wraps, or the error itself.
fn io_error(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(source) => {
            source.downcast().map_or_else(io::Error::other, |source| *source)
        }
        error => error.into(),
    }
}

#[cfg(test)]
mod tests {
    use arrow_array::Int64Array;

    use super::*;
    use crate::datasets::columns::Columns;

    #[test]
    fn full_files_and_chunks_are_followed_by_others() {
        let folder = tempfile::tempdir().unwrap();
        let mut columns = Columns::new(1);
        columns.column("number", Int64Array::from(vec![7]));
        let table = columns.into_table().unwrap();
        let mut shards = Shards::new(folder.path().to_owned(), 1);
        let mut places = Vec::new();
        for _ in 0..=FILES_OF_CHUNK {
            let Shard { chunk, file } = shards.next().unwrap();
            places.push((chunk, file));
            shards.write(&table).unwrap();
        }
        shards.close().unwrap();
        assert_eq!(places[..2], [(0, 0), (0, 1)]);
        assert_eq!(places[999..], [(0, 999), (1, 0)]);
        for name in ["chunk-000/file-999.parquet", "chunk-001/file-000.parquet"] {
            assert!(folder.path().join(name).exists(), "{name}");
        }
    }
}
