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
    /// Folder for the curves, one file for each environment and preset, and for their pictures;
    /// curves that it has get the runs that they lack
    #[arg(long)]
    out: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let (mut groups, mut runs) = (BTreeMap::new(), BTreeMap::<String, RunDescription>::new());
    if args.out.is_dir() {
        for path in entries(&args.out)? {
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
                     {name}: gather it in another folder with --out",
                    run.path().display()
                );
            }
            let group = match groups.remove(&name) {
                Some(group) => group,
                None => begin(&args.out, &name)?,
            };
            groups.insert(name, group.with_run(description.seed, &lines));
        }
    }
    ensure!(
        !groups.is_empty(),
        "{} has no curves: pass folders of runs that `train` has written",
        args.out.display()
    );
    fs::create_dir_all(&args.out)
        .with_context(|| format!("cannot make the folder {}", args.out.display()))?;
    for (name, group) in &groups {
        if runs.contains_key(name) {
            group.write(args.out.join(format!("{name}.csv")))?;
        }
        say!("{}", group.summary())?;
        save(&Curves::new(group)?, &args.out, name)?;
    }
    Ok(true)
}

/// Begins a group whose file is not in the folder yet.
fn begin(folder: &Path, name: &str) -> anyhow::Result<Group> {
    let pictures = ["svg", "png"].map(|ending| folder.join(format!("{name}.{ending}")));
    if let Some(picture) = pictures.iter().find(|path| path.symlink_metadata().is_ok()) {
        bail!(
            "{} exists, but there is no {name}.csv beside it, so it may not be the picture of a \
             curve: choose another folder with --out",
            picture.display()
        );
    }
    Ok(Group::new(name)?)
}
