//! Reads an Arrow file column by column.
//!
//! Every position and length that the file claims is checked against the file first. The reader of
//! `arrow-ipc` does not do this: it panics if a buffer lies outside of its message.

use arrow_ipc::{
    Endianness, Field, FieldNode, Footer, Precision, RecordBatch, Type, root_as_footer,
    root_as_message,
};

/// The bytes that a file begins and ends with.
const MAGIC: &[u8] = b"ARROW1";
/// The bytes before the length of a message, except in the oldest files.
const CONTINUATION: &[u8] = &[0xff; 4];

/// Why a column cannot be read.
#[derive(Debug)]
pub(super) enum Fault {
    /// The file is not an Arrow file, or not one that Minari writes.
    File(&'static str),
    Missing,
    Type {
        expected: &'static str,
    },
    /// The number of elements of a row.
    Width {
        actual: i32,
    },
}

/// The number of bytes of a number, and their decoder.
type Encoding = (usize, fn(&[u8]) -> f64);

/// A file in memory.
#[derive(Debug)]
pub(super) struct ArrowFile<'a> {
    footer: Footer<'a>,
    batches: Vec<Batch<'a>>,
}

/// Some rows of all columns.
#[derive(Debug)]
struct Batch<'a> {
    rows: usize,
    message: RecordBatch<'a>,
    /// The bytes that contain the buffers.
    body: &'a [u8],
}

/// A column, and where its parts are in each batch.
struct Column<'a> {
    field: Field<'a>,
    /// The nodes of the structs that contain it.
    outer: Vec<usize>,
    place: Place,
}

/// The numbers of the nodes and buffers that come before a field.
#[derive(Clone, Copy, Default)]
struct Place {
    node: usize,
    buffer: usize,
}

impl<'a> ArrowFile<'a> {
    /// Reads the positions of all batches.
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, Fault> {
        let no_arrow = Fault::File("it is not a whole Arrow file");
        let inner = bytes.strip_prefix(MAGIC).and_then(|_| bytes.strip_suffix(MAGIC));
        let Some((before, length)) = inner.and_then(|inner| inner.split_last_chunk()) else {
            return Err(no_arrow);
        };
        let footer = usize::try_from(i32::from_le_bytes(*length)).ok();
        let start = footer.and_then(|length| before.len().checked_sub(length));
        let Some(start) = start else { return Err(no_arrow) };
        let footer = root_as_footer(&before[start..]);
        let footer = footer.map_err(|_| Fault::File("its footer is damaged"))?;
        let schema = footer.schema().ok_or(Fault::File("it has no schema"))?;
        if schema.endianness() != Endianness::Little {
            return Err(Fault::File("its numbers are big-endian"));
        }
        let (mut batches, mut end) = (Vec::new(), 0);
        for block in footer.recordBatches().into_iter().flatten() {
            let lengths = [block.offset(), block.metaDataLength().into(), block.bodyLength()];
            let [offset, metadata, body] = lengths.map(usize::try_from);
            let (Ok(offset), Ok(metadata), Ok(body)) = (offset, metadata, body) else {
                return Err(Fault::File("one of its batches has a negative length"));
            };
            // Batches that share bytes could be far larger than the file.
            if offset < end {
                return Err(Fault::File("its batches overlap"));
            }
            let metadata = slice(bytes, offset, metadata)?;
            let start = offset + metadata.len();
            let body = slice(bytes, start, body)?;
            end = start + body.len();
            batches.push(Batch::open(metadata, body)?);
        }
        Ok(Self { footer, batches })
    }

    /// Returns the numbers of a column, in rows of `width`.
    pub(super) fn floats(&self, path: &[&str], width: usize) -> Result<Vec<f64>, Fault> {
        let Column { field, outer, place } = self.column(path)?;
        let list = field.type_as_fixed_size_list();
        let actual = list.map_or(1, |list| list.listSize());
        let item = list.and_then(|_| field.children()?.iter().next());
        let encoding = float(if list.is_some() { item } else { Some(field) });
        let (size, decode) = encoding.ok_or(Fault::Type { expected: "float32 or float64" })?;
        if usize::try_from(actual) != Ok(width) {
            return Err(Fault::Width { actual });
        }
        let mut numbers = Vec::new();
        for batch in &self.batches {
            let mut place = place;
            batch.check(&outer, batch.rows)?;
            if list.is_some() {
                batch.check(&[place.node], batch.rows)?;
                place = Place { node: place.node + 1, buffer: place.buffer + 1 };
            }
            let len = batch.rows.checked_mul(width).ok_or(OUTSIDE)?;
            batch.check(&[place.node], len)?;
            let bytes = batch.elements(place, len.checked_mul(size).ok_or(OUTSIDE)?)?;
            numbers.extend(bytes.chunks_exact(size).map(decode));
        }
        Ok(numbers)
    }

    /// Returns the elements of a column of booleans.
    pub(super) fn flags(&self, path: &[&str]) -> Result<Vec<bool>, Fault> {
        let Column { field, outer, place } = self.column(path)?;
        if field.type_type() != Type::Bool || field.dictionary().is_some() {
            return Err(Fault::Type { expected: "bool" });
        }
        let mut flags = Vec::new();
        for batch in &self.batches {
            batch.check(&outer, batch.rows)?;
            batch.check(&[place.node], batch.rows)?;
            let bytes = batch.elements(place, batch.rows.div_ceil(8))?;
            flags.extend((0..batch.rows).map(|row| bytes[row / 8] >> (row % 8) & 1 == 1));
        }
        Ok(flags)
    }

    /// Finds a column by the names of the structs that contain it and its own name.
    fn column(&self, path: &[&str]) -> Result<Column<'a>, Fault> {
        let (mut place, mut outer) = (Place::default(), Vec::new());
        let mut fields = self.footer.schema().and_then(|schema| schema.fields());
        let mut found = None;
        for name in path {
            if found.is_some() {
                outer.push(place.node);
                place = Place { node: place.node + 1, buffer: place.buffer + 1 };
            }
            let mut rest = fields.into_iter().flatten();
            let field = loop {
                let field = rest.next().ok_or(Fault::Missing)?;
                if field.name() == Some(*name) {
                    break field;
                }
                place.skip(field)?;
            };
            let is_struct = field.type_type() == Type::Struct_;
            fields = field.children().filter(|_| is_struct);
            found = Some(field);
        }
        let field = found.ok_or(Fault::Missing)?;
        Ok(Column { field, outer, place })
    }
}

/// The fault of a part that lies outside of the file.
const OUTSIDE: Fault = Fault::File("a part lies outside of it");

/// Returns a part of some bytes.
fn slice(bytes: &[u8], offset: usize, len: usize) -> Result<&[u8], Fault> {
    offset.checked_add(len).and_then(|end| bytes.get(offset..end)).ok_or(OUTSIDE)
}

/// Returns how a field's numbers are read if they have single or double precision.
fn float(field: Option<Field<'_>>) -> Option<Encoding> {
    let field = field.filter(|field| field.dictionary().is_none())?;
    match field.type_as_floating_point()?.precision() {
        Precision::SINGLE => Some((4, |bytes| {
            bytes.first_chunk().map_or(f64::NAN, |bytes| f32::from_le_bytes(*bytes).into())
        })),
        Precision::DOUBLE => Some((8, |bytes| {
            bytes.first_chunk().map_or(f64::NAN, |bytes| f64::from_le_bytes(*bytes))
        })),
        _ => None,
    }
}

impl<'a> Batch<'a> {
    fn open(metadata: &'a [u8], body: &'a [u8]) -> Result<Self, Fault> {
        let damaged = Fault::File("one of its batches is damaged");
        let metadata = metadata.strip_prefix(CONTINUATION).unwrap_or(metadata);
        let Some((length, message)) = metadata.split_first_chunk() else { return Err(damaged) };
        let length = usize::try_from(i32::from_le_bytes(*length)).ok();
        let message = length.and_then(|length| message.get(..length));
        let message = message.and_then(|bytes| root_as_message(bytes).ok());
        let message = message.and_then(|message| message.header_as_record_batch());
        let Some(message) = message else { return Err(damaged) };
        if message.compression().is_some() {
            return Err(Fault::File("it is compressed"));
        }
        let Ok(rows) = usize::try_from(message.length()) else { return Err(damaged) };
        Ok(Self { rows, message, body })
    }

    /// Checks that parts have `len` elements, none of them missing.
    fn check(&self, nodes: &[usize], len: usize) -> Result<(), Fault> {
        for node in nodes {
            let node: Option<&FieldNode> =
                self.message.nodes().and_then(|all| all.iter().nth(*node));
            let node = node.ok_or(Fault::File("it has fewer parts than columns"))?;
            if usize::try_from(node.length()) != Ok(len) {
                return Err(Fault::File("its columns have different lengths"));
            }
            if node.null_count() != 0 {
                return Err(Fault::File("elements are missing"));
            }
        }
        Ok(())
    }

    /// Returns the bytes of a field's elements, which follow the buffer that marks missing
    /// elements.
    fn elements(&self, place: Place, len: usize) -> Result<&'a [u8], Fault> {
        let buffers = self.message.buffers();
        let buffer = buffers.and_then(|all| all.iter().nth(place.buffer + 1));
        let buffer = buffer.ok_or(Fault::File("it has fewer parts than columns"))?;
        let offset = usize::try_from(buffer.offset()).map_err(|_| OUTSIDE)?;
        let length = usize::try_from(buffer.length()).map_err(|_| OUTSIDE)?;
        slice(slice(self.body, offset, length)?, 0, len)
    }
}

impl Place {
    /// Moves past a field and everything in it.
    fn skip(&mut self, field: Field<'_>) -> Result<(), Fault> {
        let (buffers, has_children) = match field.type_type() {
            _ if field.dictionary().is_some() => (2, false),
            Type::Null => (0, false),
            Type::Struct_ | Type::FixedSizeList => (1, true),
            Type::List | Type::LargeList | Type::Map => (2, true),
            Type::Utf8 | Type::LargeUtf8 | Type::Binary | Type::LargeBinary => (3, false),
            Type::Bool | Type::Int | Type::FloatingPoint | Type::FixedSizeBinary => (2, false),
            Type::Date | Type::Time | Type::Timestamp | Type::Duration => (2, false),
            _ => return Err(Fault::File("one of its columns has a type that Minari never writes")),
        };
        self.node += 1;
        self.buffer += buffers;
        let children = field.children().filter(|_| has_children);
        children.into_iter().flatten().try_for_each(|child| self.skip(child))
    }
}
