//! The arrays of an archive of episodes, read row by row, and the error of importing them.

use std::io::{self, BufReader, Read};
use std::ops::Range;

use flate2::bufread::DeflateDecoder;
use rawzip::{CompressionMethod, ZipSliceArchive};
use thiserror::Error;

use crate::add::check::AddError;
use crate::npz::header::Header;
use crate::npz::io_error;
use crate::store::fields::Field;

// The names of the arrays. `HerBuffer::export_npz` lists their contents.
pub(crate) const EPISODE_LENGTHS: &str = "episode_lengths";
pub(crate) const OBSERVATIONS: &str = "observations";
pub(crate) const ACHIEVED_GOALS: &str = "achieved_goals";
pub(crate) const DESIRED_GOALS: &str = "desired_goals";
pub(crate) const ACTIONS: &str = "actions";
pub(crate) const REWARDS: &str = "rewards";
pub(crate) const TERMINATED: &str = "terminated";
pub(crate) const TRUNCATED: &str = "truncated";

/// Returns the name of the array of a field.
pub(crate) fn field_array(field: &Field) -> String {
    format!("fields_{}", field.name)
}

/// The number of bytes of an element, and their decoder.
type Encoding<E> = (usize, fn(&[u8]) -> E);

/// The types that an array may have: a description, and the name of each in numpy's notation.
pub(crate) struct Types<E: 'static>(&'static str, &'static [(&'static str, Encoding<E>)]);

pub(crate) const FLOATS: Types<f64> = Types(
    "float32 or float64, little-endian",
    &[
        ("<f4", (4, |bytes| f32::from_bits(word(bytes) as u32).into())),
        ("<f8", (8, |bytes| f64::from_bits(word(bytes)))),
    ],
);
// Negative numbers become larger than any count.
pub(crate) const COUNTS: Types<u64> = Types(
    "int64, uint64 or int32, little-endian",
    &[
        ("<i8", (8, word)),
        ("<u8", (8, word)),
        ("<i4", (4, |bytes| i64::from(word(bytes) as i32) as u64)),
    ],
);
pub(crate) const FLAGS: Types<bool> = Types("bool", &[("|b1", (1, |bytes| word(bytes) != 0))]);

/// Returns up to eight bytes as a number.
fn word(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte))
}

/// An archive in memory.
pub(crate) type Archive<'a> = ZipSliceArchive<&'a [u8]>;

/// An array that is read from its first row to its last.
pub(crate) struct Array<'a, E> {
    name: String,
    /// The reader, at the next row.
    reader: Box<dyn Read + 'a>,
    encoding: Encoding<E>,
    rows: u64,
    /// The bytes of one row.
    row: Vec<u8>,
}

impl<'a, E> Array<'a, E> {
    /// Opens an array of one of the `types` whose rows have `width` elements, and checks the number
    /// of rows if it is given.
    pub(crate) fn open(
        archive: &'a Archive<'a>,
        name: &str,
        Types(expected, types): &Types<E>,
        width: usize,
        expected_rows: Option<u64>,
    ) -> Result<Self, NpzError> {
        let damaged = |source| NpzError::Array { array: name.to_owned(), source };
        let mut reader = BufReader::new(open_file(archive, name)?);
        let Header { descr, fortran_order, shape } = Header::read(&mut reader).map_err(damaged)?;
        let rows = shape.first().copied().unwrap_or_default();
        let len = shape.iter().try_fold(1, |len: u64, dim| len.checked_mul(*dim));
        if len.is_none() || rows.checked_mul(width as u64) != len || shape.is_empty() {
            return Err(NpzError::Shape { array: name.to_owned(), rows, width, actual: shape });
        }
        if fortran_order && shape.len() > 1 {
            return Err(damaged(io::Error::other("it is in Fortran order")));
        }
        let Some(&(_, encoding)) = types.iter().find(|(name, _)| *name == descr) else {
            let (array, actual) = (name.to_owned(), format!("'{descr}'"));
            return Err(NpzError::Type { array, expected, actual });
        };
        if let Some(expected) = expected_rows.filter(|expected| *expected != rows) {
            let (array, actual) = (name.to_owned(), vec![rows, width as u64]);
            return Err(NpzError::Shape { array, rows: expected, width, actual });
        }
        let row = vec![0; encoding.0 * width];
        Ok(Self { name: name.to_owned(), reader: Box::new(reader), encoding, rows, row })
    }

    /// Returns the number of rows.
    pub(crate) fn len(&self) -> u64 {
        self.rows
    }

    /// Reads the first element of the next row.
    pub(crate) fn next(&mut self) -> Result<E, NpzError> {
        let (size, decode) = self.encoding;
        self.read_row()?;
        Ok(decode(&self.row[..size]))
    }

    /// Reads the next `rows` rows and puts the last `kept` of them into `target`.
    pub(crate) fn take(
        &mut self,
        rows: u64,
        kept: u64,
        target: &mut Vec<E>,
    ) -> Result<(), NpzError> {
        let (size, decode) = self.encoding;
        target.clear();
        for left in (1..=rows).rev() {
            self.read_row()?;
            if left <= kept {
                target.extend(self.row.chunks_exact(size).map(decode));
            }
        }
        Ok(())
    }

    /// Checks that nothing follows the last row, which also compares the archive's checksum.
    pub(crate) fn finish(mut self) -> Result<(), NpzError> {
        let end = match self.reader.read(&mut [0]) {
            Ok(0) => return Ok(()),
            Ok(_) => io::Error::other("it continues after its last row"),
            Err(error) => error,
        };
        Err(NpzError::Array { array: self.name, source: end })
    }

    fn read_row(&mut self) -> Result<(), NpzError> {
        let read = self.reader.read_exact(&mut self.row);
        read.map_err(|source| NpzError::Array { array: self.name.clone(), source })
    }
}

/// Opens the file of an array, the last one with its name, as numpy does.
fn open_file<'a>(archive: &'a Archive<'a>, name: &str) -> Result<Box<dyn Read + 'a>, NpzError> {
    let path = format!("{name}.npy");
    let mut found = None;
    let mut files = archive.entries();
    while let Some(file) = files.next_entry().map_err(io_error)? {
        if file.file_path().as_bytes() == path.as_bytes() {
            found = Some((file.wayfinder(), file.compression_method()));
        }
    }
    let array = name.to_owned();
    let Some((place, compression)) = found else { return Err(NpzError::Missing { array }) };
    let file = match archive.get_entry(place) {
        Ok(file) => file,
        Err(error) => return Err(NpzError::Array { array, source: io_error(error) }),
    };
    // These readers compare the size and the checksum at the end.
    match compression {
        CompressionMethod::STORE => Ok(Box::new(file.verifying_reader(file.data()))),
        CompressionMethod::DEFLATE => {
            Ok(Box::new(file.verifying_reader(DeflateDecoder::new(file.data()))))
        }
        _ => {
            let source = io::Error::other("it uses a compression that numpy does not use");
            Err(NpzError::Array { array, source })
        }
    }
}

/// Error returned when episodes cannot be imported. The buffer is unchanged.
#[derive(Error)]
#[non_exhaustive]
pub enum NpzError {
    /// The archive cannot be read, or the file is not an archive.
    #[error(
        "the archive cannot be read ({0}): pass a file written by numpy.savez or \
         export_npz"
    )]
    Archive(#[from] io::Error),
    /// An array is missing.
    #[error("there is no array `{array}`: write all arrays that export_npz lists")]
    Missing {
        /// The array.
        array: String,
    },
    /// An array is damaged, or has an unsupported form.
    #[error("the array `{array}` cannot be read ({source}): write it again")]
    Array {
        /// The array.
        array: String,
        /// The cause.
        source: io::Error,
    },
    /// An array has elements of the wrong type.
    #[error("`{array}` has elements of type {actual}: convert it to {expected}")]
    Type {
        /// The array.
        array: String,
        /// The accepted types.
        expected: &'static str,
        /// Its type in numpy's notation.
        actual: String,
    },
    /// An array has the wrong shape.
    #[error("`{array}` has the shape {actual:?}: give it {rows} rows of {width} elements")]
    Shape {
        /// The array.
        array: String,
        /// The number of rows it should have.
        rows: u64,
        /// The length of a row.
        width: usize,
        /// Its shape.
        actual: Vec<u64>,
    },
    /// The lengths of the episodes are wrong.
    #[error(
        "`episode_lengths` has {found} steps up to episode {episode}, but `rewards` has \
         {expected}: make each length the number of steps of its episode, at least 1"
    )]
    Lengths {
        /// The first episode that is too long, or the last one.
        episode: u64,
        /// The steps of all episodes up to this one.
        found: u64,
        /// The number of rewards.
        expected: u64,
    },
    /// These columns of an archive of OGBench cannot contain the goals.
    #[error(
        "columns {columns:?} of {width} cannot be goals of {goal} elements: choose {goal} columns \
         of the array"
    )]
    Columns {
        /// The columns.
        columns: Range<usize>,
        /// The number of columns of the array.
        width: usize,
        /// The number of elements of a goal.
        goal: usize,
    },
    /// The last trajectory of an archive of OGBench has no end.
    #[error(
        "the trajectory that begins in row {row} does not end: set `terminals` in its last row"
    )]
    Unended {
        /// The row of its first state, from 0.
        row: u64,
    },
    /// An episode cannot be added.
    #[error("episode {episode} cannot be added: {source}")]
    Episode {
        /// The episode, from 0.
        episode: u64,
        /// The cause.
        source: AddError,
    },
}
debug_as_display!(NpzError);
