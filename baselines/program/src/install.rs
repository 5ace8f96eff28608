//! `assets` and `mujoco`: fetch the reference's model and other versions of MuJoCo into the user's
//! cache.

use std::{fs, path::PathBuf};

use fetch_install::download::{
    DownloadError, export_line, mujoco, mujoco_for, mujoco_from_wheel, reference_model,
    reference_model_from_wheel,
};

use crate::output::usage;

#[derive(clap::Args)]
pub struct AssetsArgs {
    /// Use this wheel of gymnasium-robotics 1.4.2 instead of downloading it
    #[arg(long, value_name = "WHEEL")]
    from: Option<PathBuf>,
}

pub fn assets(args: &AssetsArgs) -> anyhow::Result<bool> {
    let folder = match &args.from {
        Some(wheel) => reference_model_from_wheel(wheel),
        None => reference_model(),
    }?;
    say!("the reference model is in {}, complete and as published", folder.display())?;
    say!("its meshes are under CC BY-NC-SA 4.0: not for commercial use")?;
    Ok(true)
}

#[derive(clap::Args)]
pub struct MujocoArgs {
    /// The version, such as 3.6.0
    version: String,
    /// Use this wheel of that version instead of downloading it
    #[arg(long, value_name = "WHEEL")]
    from: Option<PathBuf>,
    /// Download it for programs of another system or processor, such as aarch64-linux
    #[arg(long = "for", value_name = "PLATFORM", conflicts_with = "from")]
    platform: Option<String>,
}

pub fn other_mujoco(args: &MujocoArgs) -> anyhow::Result<bool> {
    let MujocoArgs { version, from, platform } = args;
    let folder = match (from, platform) {
        (Some(wheel), _) => mujoco_from_wheel(version, wheel),
        (None, Some(platform)) => mujoco_for(version, platform),
        (None, None) => mujoco(version),
    };
    let folder = folder.map_err(|error| match error {
        DownloadError::Version { .. } | DownloadError::Platform { .. } => usage(error),
        error => error.into(),
    })?;
    say!("MuJoCo {version} is ready. To build with it:")?;
    say!("{}", export_line(&fs::canonicalize(folder)?))?;
    Ok(true)
}
