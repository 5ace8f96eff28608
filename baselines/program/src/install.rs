//! `assets` and `mujoco`: fetch the reference's model and other versions of MuJoCo into the user's
//! cache.

use std::{fs, path::PathBuf};

use fetch_install::download::{
    DownloadError, export_line, forget, mujoco_for, mujoco_from_wheel, reference_model,
    reference_model_from_wheel, remember,
};
use fetch_sim::{MujocoVersion, brings_library};

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
    /// The version, such as 3.6.0, or `system` to return to the system's
    version: String,
    /// Use this wheel of that version instead of downloading it
    #[arg(long, value_name = "WHEEL")]
    from: Option<PathBuf>,
    /// Download it for programs of another system or processor, such as aarch64-linux; it is not
    /// remembered
    #[arg(long = "for", value_name = "PLATFORM", conflicts_with = "from")]
    platform: Option<String>,
}

pub fn other_mujoco(args: &MujocoArgs) -> anyhow::Result<bool> {
    let MujocoArgs { version, from, platform } = args;
    if version == "system" {
        return return_to_system(args);
    }
    let folder = match (from, platform) {
        (Some(wheel), _) => mujoco_from_wheel(version, wheel).and_then(|_| remember(version)),
        (None, Some(platform)) => mujoco_for(version, platform),
        (None, None) => remember(version),
    };
    let folder = folder.map_err(|error| match error {
        DownloadError::Version { .. } | DownloadError::Platform { .. } => usage(error),
        error => error.into(),
    })?;
    let folder = fs::canonicalize(folder)?;
    if platform.is_some() {
        say!("MuJoCo {version} is ready. To build with it:")?;
        say!("{}", export_line(&folder))?;
    } else {
        say!("MuJoCo {version} is ready in {}", folder.display())?;
        say_who_takes(version)?;
    }
    Ok(true)
}

/// Forgets the remembered MuJoCo.
fn return_to_system(args: &MujocoArgs) -> anyhow::Result<bool> {
    if args.from.is_some() || args.platform.is_some() {
        return Err(usage("`system` takes no --from and no --for"));
    }
    let words = if forget()? { "forgotten" } else { "nothing was remembered" };
    let who = if brings_library() { "builds" } else { "builds and programs" };
    say!("{words}: {who} take the system's MuJoCo, unless MUJOCO_DIR names another")?;
    if brings_library() {
        say!("this program keeps the MuJoCo that it brings")?;
    }
    Ok(true)
}

/// Says which programs take the version that is remembered now.
fn say_who_takes(version: &str) -> anyhow::Result<()> {
    if brings_library() {
        return say!("builds take it from now on; this program keeps the MuJoCo that it brings");
    }
    say!(
        "builds and programs take it from now on, unless MUJOCO_DIR names another; `fetch-env \
         mujoco system` returns to the system's"
    )?;
    let built = MujocoVersion::of_headers().map(|version| version.to_string());
    if built.as_deref() != Some(version) {
        let built = built.map_or("without MuJoCo".into(), |built| format!("with MuJoCo {built}"));
        say!(
            "this program was built {built}: `cargo install` it again, with --force, to run on \
             {version} (`cargo xtask` builds it again by itself)"
        )?;
    }
    Ok(())
}
