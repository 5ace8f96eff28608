//! Linux and other systems whose libraries are ELF files.

use std::{
    env::{self, consts::ARCH},
    fs::File,
    io,
    path::{Path, PathBuf},
};

use elf::{ElfStream, ParseError, abi::DT_SONAME, endian::AnyEndian};
use fetch_install::regular_file;

use super::super::version::MujocoVersion;
use crate::privileges;

/// The plain name of MuJoCo's library.
pub(in super::super) const LIBRARY: &str = "libmujoco.so";

/// The names of the plugins that read mesh files.
pub(in super::super) const DECODER_FILES: [&str; 2] = ["libstl_decoder.so", "libobj_decoder.so"];

/// Returns the name that MuJoCo gives the library of a version.
pub(in super::super) fn library_name(version: MujocoVersion) -> String {
    format!("{LIBRARY}.{version}")
}

/// Returns the folders in which the system's loader looks for libraries.
pub(in super::super) fn folders() -> Vec<PathBuf> {
    let of_user = env::var_os("LD_LIBRARY_PATH").filter(|_| !privileges::are_raised());
    let of_user = of_user.iter().flat_map(env::split_paths).filter(|path| path.is_absolute());
    let architecture = format!("{ARCH}-linux-gnu");
    let of_system = ["/usr/local/lib", "/usr/lib"].into_iter().flat_map(|folder| {
        let folder = Path::new(folder);
        [folder.join(&architecture), folder.to_path_buf(), folder.with_file_name("lib64")]
    });
    of_user.chain(of_system).collect()
}

/// Returns the name that an ELF library gives itself, after a check that it is complete: loading a
/// truncated file would end the process.
pub(in super::super) fn own_name(path: &Path) -> Result<Option<String>, String> {
    let length = || {
        regular_file::check(path)?;
        File::open(path)?.metadata().map(|metadata| metadata.len())
    };
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
