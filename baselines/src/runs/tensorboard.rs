//! Learning curves as TensorBoard reads them.

use std::fs::{File, create_dir_all};
use std::io::{self, Write};
use std::path::Path;
use std::process;
use std::time::{SystemTime, UNIX_EPOCH};

use super::curve::CurveLine;
use crate::learn::CurveRow;

/// Writes rows of a learning curve for TensorBoard, as scalars with the names of a [`CurveLine`] and
/// of the row's [diagnostics](CurveRow::diagnostics).
///
/// A file has records of a length, its checksum, an event and its checksum; an event is a message of
/// protocol buffers. Source: TensorFlow's `record_writer.h`, `event.proto` and `summary.proto`.
#[derive(Debug)]
pub struct TensorBoard(File);

impl TensorBoard {
    /// Creates a file in a folder, beside those of other runs or of the run that this continues.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn create(folder: impl AsRef<Path>) -> io::Result<Self> {
        create_dir_all(&folder)?;
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let name = format!("events.out.tfevents.{}.{}", since.as_nanos(), process::id());
        let mut board = Self(File::create_new(folder.as_ref().join(name))?);
        board.write_event(None, &field(3, b"brain.Event:2"))?;
        Ok(board)
    }

    /// Writes a row.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write(&mut self, row: &CurveRow) -> io::Result<()> {
        let line = serde_json::to_value(CurveLine::from(row))?;
        let mut summary = Vec::new();
        let line = line.as_object().into_iter().flatten();
        let line = line.filter_map(|(name, value)| Some((name, value.as_f64()? as f32)));
        for (name, value) in line.chain(row.diagnostics.iter().map(|(name, value)| (name, *value)))
        {
            let number = [&[2 << 3 | 5], &value.to_le_bytes()[..]].concat();
            summary.extend(field(1, &[field(1, name.as_bytes()), number].concat()));
        }
        self.write_event(Some(row.counters.steps), &field(5, &summary))
    }

    fn write_event(&mut self, step: Option<u64>, what: &[u8]) -> io::Result<()> {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let mut event = vec![1 << 3 | 1];
        event.extend(now.as_secs_f64().to_le_bytes());
        if let Some(step) = step {
            event.push(2 << 3);
            event.extend(varint(step));
        }
        event.extend(what);
        let len = (event.len() as u64).to_le_bytes();
        let record = [&len[..], &checksum(&len), &event, &checksum(&event)].concat();
        self.0.write_all(&record)
    }
}

/// Returns a field of bytes.
fn field(number: u8, bytes: &[u8]) -> Vec<u8> {
    [&[number << 3 | 2], &varint(bytes.len() as u64)[..], bytes].concat()
}

fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

/// Returns the masked CRC-32C.
fn checksum(bytes: &[u8]) -> [u8; 4] {
    let crc = !bytes.iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0x82F6_3B78 * (crc & 1)))
    });
    crc.rotate_right(15).wrapping_add(0xA282_EAD8).to_le_bytes()
}
