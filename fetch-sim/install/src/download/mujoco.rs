//! A version of MuJoCo, from its wheel.

use std::path::{Path, PathBuf};

use base64::prelude::{BASE64_URL_SAFE_NO_PAD, Engine};

use super::{
    checksums::{self, hexadecimal},
    error::DownloadError,
    platform::Platform,
    unpacking::Unpacking,
    wheel::Wheel,
};
use crate::{
    contents::{LIST, is_complete, missing},
    folders::{cache_folder, name_in_cache, own_platform},
    installation::{is_version, version_in_name},
};

/// Downloads a version of MuJoCo, such as `3.6.0`, into the user's cache, unless a complete copy
/// is there, and returns its folder.
///
/// To build with it, set `MUJOCO_DIR` to the folder, as [`export_line`] does, or use [`remember`](super::remember). A
/// program that was built with the headers of this version finds the library by itself.
///
/// # Errors
/// Any [`DownloadError`].
pub fn mujoco(version: &str) -> Result<PathBuf, DownloadError> {
    mujoco_for(version, &own_platform())
}

/// Downloads a version of MuJoCo for programs of another system or processor, such as
/// `aarch64-linux`, and returns its folder, as [`mujoco`] does. Use it to build for that platform
/// on this one. The names are those of [`std::env::consts`], with the processor first.
///
/// # Errors
/// As [`mujoco`].
pub fn mujoco_for(version: &str, platform: &str) -> Result<PathBuf, DownloadError> {
    let folder = folder(version, platform)?;
    let platform = Platform::of(platform)?;
    let put = |unpacking: &Unpacking<'_>| {
        let requirement = format!("{}=={version}", package(version));
        let downloads = unpacking.downloads()?;
        let mut wheel = Wheel::fetch(&requirement, &platform.pip_arguments(), &downloads)?;
        put(&mut wheel, version, unpacking)
    };
    let is_complete = || is_complete(&folder, version, |file| checksums::is_there(&folder, file));
    Unpacking::complete(&folder, is_complete, put)?;
    Ok(folder)
}

/// Unpacks a version of MuJoCo from a wheel of the package `mujoco`, or from 4.0 on of
/// `mujoco-core`, for the platform of this program, and returns its folder, as [`mujoco`] does.
///
/// # Errors
/// As [`mujoco`].
pub fn mujoco_from_wheel(version: &str, wheel: &Path) -> Result<PathBuf, DownloadError> {
    let folder = folder(version, &own_platform())?;
    put(&mut Wheel::open(wheel)?, version, &Unpacking::begin(&folder)?)?;
    Ok(folder)
}

/// Returns the shell command that sets `MUJOCO_DIR` to a folder, with its name quoted.
#[must_use]
pub fn export_line(folder: &Path) -> String {
    let folder = folder.display().to_string();
    // Only a NUL cannot be quoted, which no path has.
    format!("export MUJOCO_DIR={}", shlex::try_quote(&folder).unwrap_or_default())
}

fn folder(version: &str, platform: &str) -> Result<PathBuf, DownloadError> {
    if !is_version(version) {
        return Err(DownloadError::Version { version: version.into() });
    }
    let cache = cache_folder().ok_or(DownloadError::NoCache)?;
    Ok(cache.join(name_in_cache(version, platform)))
}

fn put(wheel: &mut Wheel, version: &str, unpacking: &Unpacking<'_>) -> Result<(), DownloadError> {
    let (mut files, mut list) = (Vec::new(), String::new());
    for (name, sha256) in record(wheel, package(version), version)? {
        let Some(inner) = name.strip_prefix("mujoco/").filter(|name| is_wanted(name)) else {
            continue;
        };
        files.push((inner.to_owned(), wheel.read_checked(&name, &sha256)?));
        list += &format!("{sha256}  {inner}\n");
    }
    if let Some(missing) = missing(files.iter().map(|(name, _)| name.as_str()), version) {
        return Err(wheel.error(format!("it has no {missing}")));
    }
    files.push((LIST.into(), list.into_bytes()));
    files.iter().try_for_each(|(name, bytes)| unpacking.put(name, bytes))
}

/// Returns whether a file of the wheel's folder `mujoco` is needed: headers, the library and the
/// mesh decoders.
fn is_wanted(name: &str) -> bool {
    let library = |name: &str| !name.contains('/') && version_in_name(name).is_some();
    let below = |folder: &str| name.starts_with(folder) && !name.contains("..");
    below("include/") || below("plugin/") || library(name)
}

/// Returns the PyPI package with the headers and the library: from 4.0 on, `mujoco` contains only
/// Python.
fn package(version: &str) -> &'static str {
    let major = version.split('.').next().and_then(|major| major.parse().ok());
    if major.is_some_and(|major: u16| major >= 4) { "mujoco-core" } else { "mujoco" }
}

/// Returns the wheel's own list of its files, with the SHA-256 of each in hexadecimal.
fn record(
    wheel: &mut Wheel,
    package: &str,
    version: &str,
) -> Result<Vec<(String, String)>, DownloadError> {
    let folder = format!("{}-{version}.dist-info", package.replace('-', "_"));
    let bytes = wheel.read(&format!("{folder}/RECORD"))?;
    let text = String::from_utf8_lossy(&bytes);
    let lines = text.lines().map(|line| {
        parse_record(line).ok_or_else(|| wheel.error(format!("its RECORD is damaged: {line}")))
    });
    Ok(lines.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
}

/// Parses a line of RECORD into name and SHA-256: `Some(None)` if it has no digest, and `None` if
/// it is damaged.
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
    use std::path::Path;

    use super::{
        DownloadError, checksums::check, export_line, folder, is_wanted, package, parse_record,
    };

    #[test]
    fn what_is_no_version_is_an_error() {
        let wrong = folder("../3.6.0", "x86_64-linux");
        assert!(matches!(wrong, Err(DownloadError::Version { .. })), "{wrong:?}");
    }

    #[test]
    fn the_headers_moved_to_another_package() {
        assert_eq!(["2.2.2", "3.17.0", "4.0.0"].map(package), ["mujoco", "mujoco", "mujoco-core"]);
    }

    #[test]
    fn a_shell_takes_the_folder_as_it_is() -> std::io::Result<()> {
        for folder in ["/plain", "/with space", "/$(exit 3)`exit 4`", "/it's \"it\"\\", "/a\nb;c&"]
        {
            let line = export_line(Path::new(folder));
            let script = format!("{line}\nprintf %s \"$MUJOCO_DIR\"");
            let output = std::process::Command::new("sh").args(["-c", &script]).output()?;
            assert_eq!(String::from_utf8_lossy(&output.stdout), folder, "{line}");
        }
        Ok(())
    }

    #[test]
    fn nothing_is_unpacked_outside_the_folder() {
        assert!(
            ["include/mujoco/mujoco.h", "libmujoco.so.3.6.0", "mujoco.dll", "plugin/a.so"]
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
    fn digests_are_read_and_checked() -> Result<(), String> {
        // SHA-256 of nothing, as RECORD writes it.
        let line = "a,b.h,sha256=47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU,0";
        let (name, digest) = parse_record(line).flatten().unwrap_or_default();
        assert_eq!(name, "a,b.h");
        assert_eq!(digest, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
        check("nothing", b"", &digest)?;
        let wrong = check("something", b"1", &digest);
        assert!(wrong.is_err_and(|reason| reason.starts_with("something has the SHA-256 6b86b2")));
        assert_eq!(parse_record("RECORD,,"), Some(None));
        assert_eq!(parse_record("a,sha256=47DE+,1"), None);
        assert_eq!(parse_record("damaged"), None);
        Ok(())
    }
}
