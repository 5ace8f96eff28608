//! `mujoco`: fetches another version of MuJoCo from PyPI.

use std::{fs, path::PathBuf};

use anyhow::{Context, bail, ensure};
use base64::prelude::{BASE64_URL_SAFE_NO_PAD, Engine};
use lexopt::{
    Arg::{Long, Value},
    Parser, ValueExt,
};

use crate::{
    cache_folder,
    wheel::{Wheel, check_sha256, hexadecimal, replace_folder, write},
};

fn parse_version(text: &str) -> Result<String, String> {
    let parts: Vec<&str> = text.split('.').collect();
    if parts.len() == 3 && parts.iter().all(|part| part.parse::<u16>().is_ok()) {
        Ok(text.to_owned())
    } else {
        Err("a version has three numbers, such as 3.6.0".into())
    }
}

/// Whether a file of the wheel's folder `mujoco` is needed: headers, the library and the mesh decoders.
fn is_wanted(name: &str) -> bool {
    let library = |name: &str| !name.contains('/') && name.starts_with("libmujoco.");
    let below = |folder: &str| name.starts_with(folder) && !name.contains("..");
    below("include/") || below("plugin/") || library(name)
}

pub fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    let (mut version, mut from) = (None, None);
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("from") => from = Some(PathBuf::from(arguments.value()?)),
            Value(text) if version.is_none() => version = Some(text.parse_with(parse_version)?),
            other => return Err(other.unexpected().into()),
        }
    }
    let version = version.ok_or_else(|| lexopt::Error::from("name a version, such as 3.6.0"))?;
    let folder = cache_folder()?.join(format!("mujoco-{version}"));
    if from.is_some() || !folder.exists() {
        let package = package(&version);
        let mut wheel = Wheel::open_or_fetch(from.as_deref(), &format!("{package}=={version}"))?;
        let record = record(&mut wheel, package, &version)?;
        replace_folder(&folder, |new| {
            for (name, digest) in &record {
                let Some(inner) = name.strip_prefix("mujoco/").filter(|name| is_wanted(name))
                else {
                    continue;
                };
                let bytes = wheel.read(name)?;
                check_sha256(name, &bytes, digest)?;
                write(new, inner, &bytes)?;
            }
            ensure!(new.join("include/mujoco/mujoco.h").is_file(), "the wheel has no headers");
            let library = new.join(format!("libmujoco.so.{version}"));
            ensure!(library.is_file(), "the wheel has no {}", library.display());
            Ok(())
        })?;
    }
    let folder = fs::canonicalize(&folder)?;
    println!("MuJoCo {version} is ready. To build with it:");
    println!("export MUJOCO_DIR={}", folder.display());
    Ok(true)
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
) -> anyhow::Result<Vec<(String, String)>> {
    let folder = format!("{}-{version}.dist-info", package.replace('-', "_"));
    let text = String::from_utf8(wheel.read(&format!("{folder}/RECORD"))?)?;
    let mut files = Vec::new();
    for line in text.lines() {
        let mut fields = line.rsplitn(3, ',');
        let (Some(_size), Some(digest), Some(name)) = (fields.next(), fields.next(), fields.next())
        else {
            bail!("the wheel's RECORD is damaged: {line}");
        };
        if let Some(digest) = digest.strip_prefix("sha256=") {
            files.push((name.to_owned(), sha256_of(digest)?));
        }
    }
    Ok(files)
}

/// Converts a digest of RECORD, which is URL-safe base64 without padding, to hexadecimal.
fn sha256_of(digest: &str) -> anyhow::Result<String> {
    let bytes = BASE64_URL_SAFE_NO_PAD.decode(digest);
    Ok(hexadecimal(&bytes.with_context(|| format!("the digest {digest} is damaged"))?))
}

#[cfg(test)]
mod tests {
    use super::{package, sha256_of};
    use crate::wheel::check_sha256;

    #[test]
    fn the_headers_moved_to_another_package() {
        assert_eq!(["2.2.2", "3.17.0", "4.0.0"].map(package), ["mujoco", "mujoco", "mujoco-core"]);
    }

    #[test]
    fn digests_are_read_and_checked() -> anyhow::Result<()> {
        // SHA-256 of nothing, as RECORD writes it.
        let digest = sha256_of("47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU")?;
        assert_eq!(digest, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
        check_sha256("nothing", b"", &digest)?;
        assert!(check_sha256("something", b"1", &digest).is_err());
        assert!(sha256_of("47DE+").is_err());
        Ok(())
    }
}
