//! numpy's archives of arrays.

use std::{fs::File, io::Read, path::Path};

use anyhow::{Context, bail, ensure};
use her_relabel::files;
use zip::ZipArchive;

/// Rows of equal length, one for each episode and step.
pub struct Array<T> {
    pub values: Vec<T>,
    rows: usize,
    width: usize,
}

impl<T> Array<T> {
    pub fn row(&self, episode: usize, step: usize) -> &[T] {
        let first = (episode * self.rows + step) * self.width;
        &self.values[first..first + self.width]
    }
}

/// The largest array that is read, in bytes: enough for some thousand episodes, but not for a zip
/// bomb.
const MOST_BYTES: u64 = if cfg!(test) { 1 << 20 } else { 1 << 30 };

/// The largest header of an array in bytes, about ten times what numpy writes.
const MOST_HEADER_BYTES: usize = 1024;

/// The largest number of digits in a header, so that no product of its numbers overflows.
const MOST_DIGITS: usize = 16;

/// A zip archive of `.npy` files.
pub struct Npz(ZipArchive<File>);

impl Npz {
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        Ok(Self(ZipArchive::new(files::open(path)?)?))
    }

    fn bytes(&mut self, name: &str) -> anyhow::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.0
            .by_name(&format!("{name}.npy"))
            .with_context(|| format!("it has no array {name}"))?
            .take(MOST_BYTES + 1)
            .read_to_end(&mut bytes)
            .with_context(|| format!("the array {name} is damaged"))?;
        let is_small = bytes.len() as u64 <= MOST_BYTES;
        ensure!(is_small, "the array {name} has more than {MOST_BYTES} bytes");
        check_header(&bytes).with_context(|| format!("the array {name} is damaged"))?;
        Ok(bytes)
    }

    /// Returns an array and its shape.
    pub fn array<T: npyz::Deserialize>(
        &mut self,
        name: &str,
    ) -> anyhow::Result<(Vec<T>, Vec<usize>)> {
        let bytes = self.bytes(name)?;
        let array = npyz::NpyFile::new(bytes.as_slice())
            .with_context(|| format!("the array {name} is damaged"))?;
        ensure!(
            array.order() == npyz::Order::C,
            "the array {name} is in Fortran order: save it in C order"
        );
        let shape = array.shape().iter().map(|&n| n as usize).collect();
        let values = array.into_vec().with_context(|| format!("the array {name}"))?;
        Ok((values, shape))
    }

    /// Returns an array of one dimension, or of none.
    pub fn vector<T: npyz::Deserialize>(
        &mut self,
        name: &str,
        len: usize,
    ) -> anyhow::Result<Vec<T>> {
        let (values, shape) = self.array(name)?;
        ensure!(values.len() == len, "the array {name} has the shape {shape:?}, not [{len}]");
        Ok(values)
    }

    /// Returns an array of the shape `[outer.., width]`, or `outer` without a width.
    pub fn rows<T: npyz::Deserialize>(
        &mut self,
        name: &str,
        outer: [usize; 2],
        width: Option<usize>,
    ) -> anyhow::Result<Array<T>> {
        let (values, shape) = self.array(name)?;
        let expected: Vec<usize> = outer.into_iter().chain(width).collect();
        ensure!(shape == expected, "the array {name} has the shape {shape:?}, not {expected:?}");
        Ok(Array { values, rows: outer[1], width: width.unwrap_or(1) })
    }

    /// Returns a string, which numpy stores as UTF-32.
    pub fn text(&mut self, name: &str) -> anyhow::Result<String> {
        let bytes = self.bytes(name)?;
        let header = npyz::NpyFile::new(bytes.as_slice())
            .with_context(|| format!("the array {name} is damaged"))?;
        let length = match header.dtype() {
            npyz::DType::Plain(text) if text.type_char() == npyz::TypeChar::UnicodeStr => {
                4 * text.size_field() as usize
            }
            other => bail!("the array {name} is not a string, but {}", other.descr()),
        };
        ensure!(bytes.len() >= length, "the array {name} is damaged");
        bytes[bytes.len() - length..]
            .chunks_exact(4)
            .map(|c| u32::from_le_bytes([c[0], c[1], c[2], c[3]]))
            .take_while(|&c| c != 0)
            .map(|c| char::from_u32(c).context("the text is damaged"))
            .collect()
    }
}

/// Checks that an array has a plain header. Parsing any other could overflow, or take unbounded
/// memory and stack.
fn check_header(bytes: &[u8]) -> anyhow::Result<()> {
    // From version 2 on, the length has four bytes instead of two.
    let (len, rest) = match bytes {
        [_, _, _, _, _, _, 0..2, _, a, b, rest @ ..] => ([*a, *b, 0, 0], rest),
        [_, _, _, _, _, _, _, _, a, b, c, d, rest @ ..] => ([*a, *b, *c, *d], rest),
        _ => bail!("it has no header"),
    };
    let len = u32::from_le_bytes(len) as usize;
    let header = rest.get(..len).context("its header is cut off")?;
    let count = |is_it: fn(&u8) -> bool| header.iter().filter(|byte| is_it(byte)).count();
    let is_plain = len <= MOST_HEADER_BYTES
        && header.is_ascii()
        && count(u8::is_ascii_digit) <= MOST_DIGITS
        && count(|byte| matches!(byte, b'(' | b'[' | b'{')) <= 2;
    ensure!(is_plain, "its header is not that of plain numbers or text");
    Ok(())
}
