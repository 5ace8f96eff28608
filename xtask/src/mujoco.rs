//! `mujoco`: another version of MuJoCo, from PyPI.

use std::{fs, path::PathBuf};

use anyhow::{Context, bail, ensure};
use fetch_sim::cache_folder;

use crate::wheel::{Wheel, check_sha256, replace_folder, write};

#[derive(clap::Args)]
pub struct Args {
    /// The version, such as 3.6.0
    #[arg(value_parser = parse_version)]
    version: String,
    /// A wheel of that version that is already there
    #[arg(long)]
    from: Option<PathBuf>,
}

fn parse_version(text: &str) -> Result<String, String> {
    let parts: Vec<&str> = text.split('.').collect();
    if parts.len() == 3 && parts.iter().all(|part| part.parse::<u16>().is_ok()) {
        Ok(text.to_owned())
    } else {
        Err("no version such as 3.6.0".into())
    }
}

/// What of the wheel's folder `mujoco` is needed: headers, the library and the mesh decoders.
fn is_wanted(name: &str) -> bool {
    let library = |name: &str| !name.contains('/') && name.starts_with("libmujoco.");
    let below = |folder: &str| name.starts_with(folder) && !name.contains("..");
    below("include/") || below("plugin/") || library(name)
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let folder = cache_folder()?.join(format!("mujoco-{}", args.version));
    if args.from.is_some() || !folder.exists() {
        let download = tempfile::tempdir()?;
        let mut wheel = match &args.from {
            Some(path) => Wheel::open(path)?,
            None => Wheel::fetch(&format!("mujoco=={}", args.version), download.path())?,
        };
        let record = record(&mut wheel, &args.version)?;
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
            let library = new.join(format!("libmujoco.so.{}", args.version));
            ensure!(library.is_file(), "the wheel has no {}", library.display());
            Ok(())
        })?;
    }
    let folder = fs::canonicalize(&folder)?;
    println!("MuJoCo {} is ready. To build with it:", args.version);
    println!("export MUJOCO_DIR={}", folder.display());
    Ok(true)
}

/// The wheel's own list of its files, with the SHA-256 of each in hexadecimal.
fn record(wheel: &mut Wheel, version: &str) -> anyhow::Result<Vec<(String, String)>> {
    let text = String::from_utf8(wheel.read(&format!("mujoco-{version}.dist-info/RECORD"))?)?;
    let mut files = Vec::new();
    for line in text.lines() {
        let mut fields = line.rsplitn(3, ',');
        let (Some(_size), Some(digest), Some(name)) = (fields.next(), fields.next(), fields.next())
        else {
            bail!("the wheel's RECORD is damaged: {line}");
        };
        if let Some(digest) = digest.strip_prefix("sha256=") {
            files.push((name.to_owned(), hexadecimal(digest)?));
        }
    }
    Ok(files)
}

/// URL-safe base64 without padding, as RECORD has it, in hexadecimal.
fn hexadecimal(digest: &str) -> anyhow::Result<String> {
    let mut bits = 0_u32;
    let mut held = 0;
    let mut hex = String::new();
    for symbol in digest.bytes() {
        let value = match symbol {
            b'A'..=b'Z' => symbol - b'A',
            b'a'..=b'z' => symbol - b'a' + 26,
            b'0'..=b'9' => symbol - b'0' + 52,
            b'-' => 62,
            b'_' => 63,
            _ => return None.with_context(|| format!("the digest {digest} is damaged")),
        };
        bits = (bits << 6) | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            hex.push_str(&format!("{:02x}", (bits >> held) & 0xff));
        }
    }
    Ok(hex)
}

#[cfg(test)]
mod tests {
    use super::hexadecimal;

    #[test]
    fn digests_are_read() {
        // SHA-256 of nothing, as RECORD writes it.
        assert_eq!(
            hexadecimal("47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU").unwrap(),
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
        );
        assert!(hexadecimal("47DE+").is_err());
    }
}
