//! The file of a library, checked before it is loaded: loading runs its code, and a truncated file
//! would end the process.

use std::{
    fs::File,
    io,
    path::{Path, PathBuf},
};

use elf::{ElfStream, ParseError, abi::DT_SONAME, endian::AnyEndian};

use super::trust;

/// A library that may be loaded.
pub(crate) struct LibraryFile {
    /// Its path, without links.
    pub(crate) path: PathBuf,
    /// The name that it gives itself, such as `libmujoco.so.2.2.2`.
    pub(crate) own_name: Option<String>,
}

impl LibraryFile {
    /// Checks a library without loading it.
    ///
    /// # Errors
    /// The reason not to load it: it is missing or truncated, or users other than this one and root
    /// may have written it.
    pub(crate) fn look_at(file: &Path) -> Result<Self, String> {
        let path = file.canonicalize().map_err(|error| error.to_string())?;
        trust::check(&path)?;
        let own_name = if cfg!(target_vendor = "apple") { None } else { own_name(&path)? };
        Ok(Self { path, own_name })
    }
}

/// Returns the name that an ELF library gives itself, after a check that it is complete.
fn own_name(path: &Path) -> Result<Option<String>, String> {
    let length = || File::open(path)?.metadata().map(|metadata| metadata.len());
    let length = length().map_err(|error| error.to_string())?;
    parse(path, length).map_err(|error| match error {
        ParseError::BadMagic(_) => "it is not a library".into(),
        ParseError::IOError(error) if error.kind() != io::ErrorKind::UnexpectedEof => {
            error.to_string()
        }
        _ => format!("it is truncated or damaged ({length} bytes)"),
    })
}

fn parse(path: &Path, length: u64) -> Result<Option<String>, ParseError> {
    let mut elf = ElfStream::<AnyEndian, _>::open_stream(File::open(path)?)?;
    let is_whole = elf.segments().iter().all(|segment| {
        segment.p_offset.checked_add(segment.p_filesz).is_some_and(|end| end <= length)
    });
    if !is_whole {
        return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
    }
    let entries = elf.dynamic()?.into_iter().flatten();
    let offset = entries.filter(|entry| entry.d_tag == DT_SONAME).map(|entry| entry.d_val()).next();
    let (Some(offset), Some((_, strings))) = (offset, elf.dynamic_symbol_table()?) else {
        return Ok(None);
    };
    Ok(Some(strings.get(offset as usize)?.to_owned()))
}
