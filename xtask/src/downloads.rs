//! `assets` and `mujoco`: fetch the reference's model and other versions of MuJoCo into the user's
//! cache.

use std::{fs, path::PathBuf};

use fetch_install::download::{
    DownloadError, export_line, mujoco, mujoco_for, mujoco_from_wheel, reference_model,
    reference_model_from_wheel,
};
use lexopt::{
    Arg::{Long, Value},
    Parser, ValueExt,
};

pub fn assets(mut arguments: Parser) -> anyhow::Result<bool> {
    let mut from = None;
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("from") => from = Some(PathBuf::from(arguments.value()?)),
            other => return Err(other.unexpected().into()),
        }
    }
    let folder = match from {
        Some(wheel) => reference_model_from_wheel(&wheel),
        None => reference_model(),
    }?;
    say!("the reference model is in {}, complete and as published", folder.display())?;
    say!("its meshes are under CC BY-NC-SA 4.0: not for commercial use")?;
    Ok(true)
}

pub fn other_mujoco(mut arguments: Parser) -> anyhow::Result<bool> {
    let (mut version, mut from, mut platform) = (None, None, None);
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("from") if platform.is_none() => from = Some(PathBuf::from(arguments.value()?)),
            Long("for") if from.is_none() => platform = Some(arguments.value()?.string()?),
            Value(text) if version.is_none() => version = Some(text.string()?),
            other => return Err(other.unexpected().into()),
        }
    }
    let version = version.ok_or_else(|| lexopt::Error::from("name a version, such as 3.6.0"))?;
    let folder = match (from, platform) {
        (Some(wheel), _) => mujoco_from_wheel(&version, &wheel),
        (None, Some(platform)) => mujoco_for(&version, &platform),
        (None, None) => mujoco(&version),
    };
    let folder = fs::canonicalize(folder.map_err(|error| match error {
        DownloadError::Version { .. } | DownloadError::Platform { .. } => {
            lexopt::Error::from(error.to_string()).into()
        }
        error => anyhow::Error::from(error),
    })?)?;
    say!("MuJoCo {version} is ready. To build with it:")?;
    say!("{}", export_line(&folder))?;
    Ok(true)
}
