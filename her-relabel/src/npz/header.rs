//! The header of a numpy array: the type, the order and the shape of its elements.
//!
//! Source: the NPY format, <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use std::io::{self, Read};

const MAGIC: [u8; 6] = *b"\x93NUMPY";

/// The size of a header is a multiple of this number of bytes, which aligns the elements.
const ALIGNMENT: usize = 64;

/// The largest size of a header in bytes, about ten times what numpy writes.
const MAX_LEN: usize = 1024;

/// The contents of an array's header.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Header {
    /// The type in numpy's notation.
    pub(crate) descr: String,
    /// Whether the first index varies fastest.
    pub(crate) fortran_order: bool,
    pub(crate) shape: Vec<u64>,
}

impl Header {
    /// Returns the header as the beginning of a file.
    pub(crate) fn to_bytes(&self) -> io::Result<Vec<u8>> {
        let Self { descr, fortran_order, shape } = self;
        let order = if *fortran_order { "True" } else { "False" };
        let lens: String = shape.iter().map(|len| format!("{len}, ")).collect();
        // A tuple of one element ends with a comma.
        let lens = if shape.len() == 1 { lens.trim_end() } else { lens.trim_end_matches(", ") };
        let text = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': ({lens}), }}");
        let before = MAGIC.len() + 4;
        let len = (before + text.len() + 1).next_multiple_of(ALIGNMENT) - before;
        let version = [1, 0];
        let size = u16::try_from(len).map_err(io::Error::other)?.to_le_bytes();
        let padded = format!("{text:<width$}\n", width = len - 1);
        Ok([&MAGIC[..], &version, &size, padded.as_bytes()].concat())
    }

    /// Reads a header from the beginning of a file, if its elements are plain.
    pub(crate) fn read(file: &mut impl Read) -> io::Result<Self> {
        let mut start = [0; MAGIC.len() + 2];
        file.read_exact(&mut start)?;
        // From version 2 on, the length has four bytes instead of two.
        let size = match start[MAGIC.len()] {
            _ if !start.starts_with(&MAGIC) => return Err(refused("it is not a numpy array")),
            1 => 2,
            2 | 3 => 4,
            _ => return Err(refused("its version is unknown")),
        };
        let mut len = [0; 4];
        file.read_exact(&mut len[..size])?;
        let len = u32::from_le_bytes(len) as usize;
        if len > MAX_LEN {
            return Err(refused("its header is too long"));
        }
        let mut text = vec![0; len];
        file.read_exact(&mut text)?;
        let text = str::from_utf8(&text).ok();
        let header = text.and_then(|text| Text(text).header());
        header.ok_or_else(|| refused("its header is not that of plain elements"))
    }
}

fn refused(reason: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, reason)
}

/// The unread rest of a header's text, a dictionary in Python's notation.
struct Text<'a>(&'a str);

impl<'a> Text<'a> {
    /// Reads the whole text.
    fn header(mut self) -> Option<Header> {
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        self.expect("{")?;
        while !self.eat("}") {
            let key = self.quoted()?;
            self.expect(":")?;
            match key {
                "descr" => descr = Some(self.quoted()?.to_owned()),
                "fortran_order" => fortran_order = Some(self.flag()?),
                "shape" => shape = Some(self.tuple()?),
                _ => return None,
            }
            if !self.eat(",") {
                self.expect("}")?;
                break;
            }
        }
        let header = Header { descr: descr?, fortran_order: fortran_order?, shape: shape? };
        self.0.trim().is_empty().then_some(header)
    }

    /// Takes a token if it is the next one.
    fn eat(&mut self, token: &str) -> bool {
        let rest = self.0.trim_start().strip_prefix(token);
        self.0 = rest.unwrap_or(self.0);
        rest.is_some()
    }

    fn expect(&mut self, token: &str) -> Option<()> {
        self.eat(token).then_some(())
    }

    /// Takes a string.
    fn quoted(&mut self) -> Option<&'a str> {
        let quote = ["'", "\""].into_iter().find(|quote| self.eat(quote))?;
        let (string, rest) = self.0.split_once(quote)?;
        self.0 = rest;
        Some(string)
    }

    fn flag(&mut self) -> Option<bool> {
        let is_true = self.eat("True");
        (is_true || self.eat("False")).then_some(is_true)
    }

    /// Takes a tuple of numbers.
    fn tuple(&mut self) -> Option<Vec<u64>> {
        let mut numbers = Vec::new();
        self.expect("(")?;
        while !self.eat(")") {
            numbers.push(self.number()?);
            if !self.eat(",") {
                self.expect(")")?;
                break;
            }
        }
        Some(numbers)
    }

    fn number(&mut self) -> Option<u64> {
        let text = self.0.trim_start();
        let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
        let (digits, rest) = text.split_at(end);
        self.0 = rest;
        digits.parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(text: &str) -> Option<Header> {
        Text(text).header()
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(
            descr in "[<>|=][a-zA-Z][0-9]{0,3}",
            fortran_order in any::<bool>(),
            shape in prop::collection::vec(any::<u64>(), 0..20),
            rest in prop::collection::vec(any::<u8>(), 0..9),
        ) {
            let header = Header { descr, fortran_order, shape };
            let bytes = header.to_bytes()?;
            prop_assert!(bytes.len().is_multiple_of(ALIGNMENT) && bytes.ends_with(b"\n"));
            let file = [bytes, rest.clone()].concat();
            let mut file = file.as_slice();
            prop_assert_eq!(Header::read(&mut file)?, header);
            prop_assert_eq!(file, rest);
        }

        #[test]
        fn any_text_is_read_or_refused(text in "[{}()\\[\\]'\":,a-z0-9 ]{0,60}") {
            let _ = read(&text);
        }
    }

    #[test]
    fn the_header_is_the_one_that_numpy_writes() -> io::Result<()> {
        // `numpy.save` of `numpy.zeros((3,))` and of `numpy.zeros((3, 2), "f4")`.
        for (descr, shape, text) in [
            ("<f8", vec![3], "{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }"),
            ("<f4", vec![3, 2], "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 2), }"),
        ] {
            let header = Header { descr: descr.into(), fortran_order: false, shape };
            let expected = format!("{text:<117}\n");
            let expected = [b"\x93NUMPY\x01\x00\x76\x00", expected.as_bytes()].concat();
            assert_eq!(header.to_bytes()?, expected);
        }
        Ok(())
    }

    #[test]
    fn other_notations_of_a_dictionary_are_read() {
        let expected = Header { descr: "<f8".into(), fortran_order: true, shape: vec![6, 1] };
        for text in [
            "{'descr': '<f8', 'fortran_order': True, 'shape': (6, 1)}",
            " { \"shape\" : ( 6 ,1, ), 'fortran_order':True , 'descr':\"<f8\", } \n",
        ] {
            assert_eq!(read(text), Some(expected.clone()), "{text}");
        }
        let scalar = "{'descr': '|b1', 'fortran_order': False, 'shape': ()}";
        assert_eq!(read(scalar).map(|header| header.shape), Some(Vec::new()));
    }

    #[test]
    fn anything_but_plain_elements_is_refused() {
        for text in [
            "",
            "{}",
            "{'descr': '<f8', 'fortran_order': False}",
            "{'descr': [('x', '<f8')], 'fortran_order': False, 'shape': (6,)}",
            "{'descr': '<f8', 'fortran_order': 0, 'shape': (6,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (-6,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (18446744073709551616,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': 6}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (,)}",
            "{'descr': '<f8' 'fortran_order': False, 'shape': (6,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (6,), 'other': 1}",
            "{'descr': '<f8, 'fortran_order': False, 'shape': (6,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (6,)} 1",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (6,)",
        ] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
