//! `learning-curves`: gathers runs, says when each reached its target, and draws their curves.

mod drawing;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail, ensure};
use baselines::runs::{Group, RunDescription, RunFolder};

use self::drawing::Curves;
use crate::figures::save;
use crate::shared::folders::{entries, runs_in};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folders of runs to add, as `train` writes them, or folders that contain such folders
    runs: Vec<PathBuf>,
    /// Folder of the curves, one file for each environment and preset, and of their pictures
    #[arg(long, default_value = "baselines/learning")]
    folder: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let (mut groups, mut runs) = (BTreeMap::new(), BTreeMap::<String, RunDescription>::new());
    if args.folder.is_dir() {
        for path in entries(&args.folder)? {
            let name = path.file_name().and_then(|name| name.to_str()?.strip_suffix(".csv"));
            // Other names are those of other files.
            if let Some(name) = name
                && let Ok(group) = Group::new(name)
            {
                groups.insert(name.to_owned(), group.read(&path)?);
            }
        }
    }
    for folder in &args.runs {
        for run in runs_in(folder)? {
            let run = RunFolder::open(run)?;
            let (description, lines) = (run.description(), run.read_curve()?);
            let name = description.group();
            if let Some(other) = runs.insert(name.clone(), description.clone()) {
                ensure!(
                    other.differs_in_seed_alone(description),
                    "{} is a different run from those before it, but its curve has the same name, \
                     {name}: gather it in another folder with --folder",
                    run.path().display()
                );
            }
            let group = match groups.remove(&name) {
                Some(group) => group,
                None => begin(&args.folder, &name)?,
            };
            groups.insert(name, group.with_run(description.seed, &lines));
        }
    }
    ensure!(
        !groups.is_empty(),
        "{} has no curves: pass folders of runs that `train` has written",
        args.folder.display()
    );
    fs::create_dir_all(&args.folder)
        .with_context(|| format!("cannot make the folder {}", args.folder.display()))?;
    for (name, group) in &groups {
        if runs.contains_key(name) {
            group.write(args.folder.join(format!("{name}.csv")))?;
        }
        say!("{}", group.summary())?;
        save(&Curves::new(group)?, &args.folder, name)?;
    }
    Ok(true)
}

/// Begins a group whose file is not in the folder yet.
fn begin(folder: &Path, name: &str) -> anyhow::Result<Group> {
    let pictures = ["svg", "png"].map(|ending| folder.join(format!("{name}.{ending}")));
    if let Some(picture) = pictures.iter().find(|path| path.symlink_metadata().is_ok()) {
        bail!(
            "{} exists, but there is no {name}.csv beside it, so it may not be the picture of a \
             curve: choose another folder with --folder",
            picture.display()
        );
    }
    Ok(Group::new(name)?)
}
