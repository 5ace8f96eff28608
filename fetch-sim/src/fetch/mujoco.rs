//! A version of MuJoCo, from its wheel.

use std::path::{Path, PathBuf};

use base64::prelude::{BASE64_URL_SAFE_NO_PAD, Engine};

use super::{
    error::FetchError,
    wheel::{Wheel, check_sha256, hexadecimal, replace_folder, write},
};
use crate::{cache, installation::libraries_in};

/// Fetches a version of MuJoCo, such as `3.6.0`, into the user's cache unless it is there, and returns
/// its folder.
///
/// To build with it, set `MUJOCO_DIR` to the folder. A program that was built with the headers of this
/// version finds the library by itself.
///
/// # Errors
/// Any [`FetchError`].
pub fn mujoco(version: &str) -> Result<PathBuf, FetchError> {
    let folder = folder(version)?;
    if !(has_headers(&folder) && has_library(&folder, version)) {
        unpack(None, version, &folder)?;
    }
    Ok(folder)
}

/// As [`mujoco`], from the wheel of that version at a path: of the package `mujoco`, and from 4.0 on of
/// `mujoco-core`.
///
/// # Errors
/// As [`mujoco`].
pub fn mujoco_from_wheel(version: &str, wheel: &Path) -> Result<PathBuf, FetchError> {
    let folder = folder(version)?;
    unpack(Some(wheel), version, &folder)?;
    Ok(folder)
}

fn folder(version: &str) -> Result<PathBuf, FetchError> {
    let numbers = version.split('.').map(str::parse::<u16>).filter(Result::is_ok).count();
    if numbers != 3 || version.split('.').count() != 3 || version.contains('+') {
        return Err(FetchError::Version { version: version.into() });
    }
    let cache = cache::cache_folder().ok_or(FetchError::NoCache)?;
    Ok(cache.join(format!("mujoco-{version}")))
}

fn unpack(wheel: Option<&Path>, version: &str, folder: &Path) -> Result<(), FetchError> {
    let package = package(version);
    let mut wheel = Wheel::open_or_fetch(wheel, &format!("{package}=={version}"))?;
    let record = record(&mut wheel, package, version)?;
    replace_folder(folder, |new| {
        for (name, digest) in &record {
            let Some(inner) = name.strip_prefix("mujoco/").filter(|name| is_wanted(name)) else {
                continue;
            };
            let bytes = wheel.read(name)?;
            check_sha256(name, &bytes, digest)?;
            write(new, inner, &bytes)?;
        }
        if !has_headers(new) {
            return Err(wheel.error("it has no headers".into()));
        }
        if !has_library(new, version) {
            return Err(wheel.error(format!("it has no library of MuJoCo {version}")));
        }
        Ok(())
    })
}

fn has_headers(folder: &Path) -> bool {
    folder.join("include/mujoco/mujoco.h").is_file()
}

fn has_library(folder: &Path, version: &str) -> bool {
    let is_of_version = |path: &PathBuf| {
        path.file_name().is_some_and(|name| name.to_string_lossy().contains(version))
    };
    libraries_in(folder).iter().any(is_of_version)
}

/// Whether a file of the wheel's folder `mujoco` is needed: headers, the library and the mesh decoders.
fn is_wanted(name: &str) -> bool {
    let library = |name: &str| !name.contains('/') && name.starts_with("libmujoco.");
    let below = |folder: &str| name.starts_with(folder) && !name.contains("..");
    below("include/") || below("plugin/") || library(name)
}

/// Returns the PyPI package with the headers and the library: from 4.0 on, `mujoco` is Python alone.
fn package(version: &str) -> &'static str {
    let major = version.split('.').next().and_then(|major| major.parse().ok());
    if major.is_some_and(|major: u16| major >= 4) { "mujoco-core" } else { "mujoco" }
}

/// Returns the wheel's own list of its files, with the SHA-256 of each in hexadecimal.
fn record(
    wheel: &mut Wheel,
    package: &str,
    version: &str,
) -> Result<Vec<(String, String)>, FetchError> {
    let folder = format!("{}-{version}.dist-info", package.replace('-', "_"));
    let bytes = wheel.read(&format!("{folder}/RECORD"))?;
    let text = String::from_utf8_lossy(&bytes);
    let lines = text.lines().map(|line| {
        parse_record(line).ok_or_else(|| wheel.error(format!("its RECORD is damaged: {line}")))
    });
    Ok(lines.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
}

/// Parses a line of RECORD into name and SHA-256: `Some(None)` if it has no digest, and `None` if it is
/// damaged.
fn parse_record(line: &str) -> Option<Option<(String, String)>> {
    let mut fields = line.rsplitn(3, ',').skip(1); // the size
    let (digest, name) = (fields.next()?, fields.next()?);
    match digest.strip_prefix("sha256=") {
        Some(digest) => Some(Some((name.to_owned(), sha256_of(digest)?))),
        None => Some(None),
    }
}

/// Converts a digest of RECORD, which is URL-safe base64 without padding, to hexadecimal.
fn sha256_of(digest: &str) -> Option<String> {
    Some(hexadecimal(&BASE64_URL_SAFE_NO_PAD.decode(digest).ok()?))
}

#[cfg(test)]
mod tests {
    use super::{FetchError, check_sha256, folder, is_wanted, package, parse_record};

    #[test]
    fn a_version_has_three_numbers() {
        for wrong in ["", "3.6", "3.6.0.1", "3.6.x", "3.6.+0", "../3.6.0", "3.6.0 "] {
            assert!(matches!(folder(wrong), Err(FetchError::Version { .. })), "{wrong}");
        }
    }

    #[test]
    fn the_headers_moved_to_another_package() {
        assert_eq!(["2.2.2", "3.17.0", "4.0.0"].map(package), ["mujoco", "mujoco", "mujoco-core"]);
    }

    #[test]
    fn nothing_is_unpacked_outside_the_folder() {
        assert!(
            ["include/mujoco/mujoco.h", "libmujoco.so.3.6.0", "plugin/a.so"]
                .iter()
                .all(|n| is_wanted(n))
        );
        assert!(
            !["include/../../a", "../libmujoco.so", "x/libmujoco.so", "a.py"]
                .iter()
                .any(|n| is_wanted(n))
        );
    }

    #[test]
    fn digests_are_read_and_checked() -> Result<(), FetchError> {
        // SHA-256 of nothing, as RECORD writes it.
        let line = "a,b.h,sha256=47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU,0";
        let (name, digest) = parse_record(line).flatten().unwrap_or_default();
        assert_eq!(name, "a,b.h");
        assert_eq!(digest, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
        check_sha256("nothing", b"", &digest)?;
        let wrong = check_sha256("something", b"1", &digest);
        assert!(matches!(wrong, Err(FetchError::Checksum { .. })));
        assert_eq!(parse_record("RECORD,,"), Some(None));
        assert_eq!(parse_record("a,sha256=47DE+,1"), None);
        assert_eq!(parse_record("damaged"), None);
        Ok(())
    }
}
