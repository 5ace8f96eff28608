//! A numpy array whose length is known only at the end.

use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

use crate::archive::Archive;

/// The beginning of a file, up to its version.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// The size of a header is a multiple of this number of bytes, which aligns the elements.
const ALIGNMENT: usize = 64;

/// A type of an array's elements.
pub(super) trait Element: Copy {
    /// Its name in numpy's notation.
    const TYPE: &'static str;

    fn write(self, out: &mut impl Write) -> io::Result<()>;
}

macro_rules! elements {
    ($($element:ty => $name:literal),*) => {
        $(impl Element for $element {
            const TYPE: &'static str = $name;

            fn write(self, out: &mut impl Write) -> io::Result<()> {
                out.write_all(&self.to_le_bytes())
            }
        })*
    };
}

elements!(f32 => "<f4", f64 => "<f8", u64 => "<u8");

impl Element for bool {
    const TYPE: &'static str = "|b1";

    fn write(self, out: &mut impl Write) -> io::Result<()> {
        out.write_all(&[self.into()])
    }
}

/// An array in an unnamed temporary file, which never stays behind.
#[derive(Debug)]
pub(super) struct Column {
    name: &'static str,
    dtype: &'static str,
    /// The shape of a row: empty for a vector.
    row: Vec<u64>,
    file: BufWriter<File>,
    elements: u64,
}

impl Column {
    /// Creates an array in a temporary file in `folder`. `width` is the length of a row; `None`
    /// makes it a vector.
    pub(super) fn create<T: Element>(
        name: &'static str,
        width: Option<usize>,
        folder: &Path,
    ) -> io::Result<Self> {
        let row = width.map(|width| width as u64).into_iter().collect();
        let file = BufWriter::new(tempfile::tempfile_in(folder)?);
        Ok(Self { name, dtype: T::TYPE, row, file, elements: 0 })
    }

    /// Adds elements of the type with which it was created.
    pub(super) fn extend<T: Element>(
        &mut self,
        elements: impl IntoIterator<Item = T>,
    ) -> io::Result<()> {
        debug_assert_eq!(self.dtype, T::TYPE, "{}", self.name);
        for element in elements {
            element.write(&mut self.file)?;
            self.elements += 1;
        }
        Ok(())
    }

    /// Writes the array to an archive.
    pub(super) fn write_to(self, archive: &mut Archive<'_>) -> io::Result<()> {
        let rows = self.elements / self.row.iter().product::<u64>().max(1);
        let shape: Vec<_> = [rows].into_iter().chain(self.row).collect();
        let header = header(self.dtype, &shape)?;
        let mut file = self.file.into_inner()?;
        file.rewind()?;
        let name = format!("{}.npy", self.name);
        let part = archive.part(&name)?;
        part.write_all(&header)?;
        io::copy(&mut file, part)?;
        Ok(())
    }
}

/// Returns what precedes the elements of an array in version 1.0 of numpy's format.
///
/// Source: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.
fn header(dtype: &str, shape: &[u64]) -> io::Result<Vec<u8>> {
    let shape: String = shape.iter().map(|len| format!("{len}, ")).collect();
    let text = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}");
    let before = MAGIC.len() + 2;
    let len = (before + text.len() + 1).next_multiple_of(ALIGNMENT) - before;
    let size = u16::try_from(len).map_err(io::Error::other)?.to_le_bytes();
    Ok([MAGIC, &size[..], format!("{text:<width$}\n", width = len - 1).as_bytes()].concat())
}

#[cfg(test)]
mod tests {
    use npyz::{WriteOptions, WriterBuilder};

    use super::*;

    #[test]
    fn headers_are_those_of_npyz() -> io::Result<()> {
        for shape in [&[7][..], &[51, 25], &[1_000_000_000_000, 3]] {
            let dtype = npyz::DType::Plain("<f8".parse().map_err(io::Error::other)?);
            let mut expected = Vec::new();
            let options = WriteOptions::new_header_only().dtype(dtype).shape(shape);
            options.writer(&mut expected).write_header_only()?;
            assert_eq!(header("<f8", shape)?, expected);
        }
        Ok(())
    }
}
