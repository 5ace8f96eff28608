//! `projects`: builds and tests the projects outside the workspace, as their users would, and the
//! README's programs.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::Context;

use crate::output::usage;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const FOLDER: &str = "fetch-env/projects";
const FIRST_PROGRAM: &str = "quickstart";
/// The path of the crates in the README's dependencies.
const CRATES: &str = "../fetch/";

#[derive(clap::Args)]
pub struct Args {
    /// Test only this folder of fetch-env/projects, or only quickstart
    #[arg(long, value_name = "PROJECT")]
    only: Option<String>,
    /// Do not test this project
    #[arg(long, value_name = "PROJECT")]
    exclude: Vec<String>,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let root = fs::canonicalize(ROOT)?;
    let mut names = names(&root.join(FOLDER))?;
    names.push(FIRST_PROGRAM.into());
    for name in args.only.iter().chain(&args.exclude) {
        if !names.contains(name) {
            let all = names.join(", ");
            return Err(usage(format_args!("there is no {name}: the projects are {all}")));
        }
    }
    names.retain(|name| args.only.as_ref().is_none_or(|only| only == name));
    names.retain(|name| !args.exclude.contains(name));
    if names.is_empty() {
        return Err(usage("no project is left to test"));
    }
    for name in names {
        say!("projects: {name}")?;
        let passed = if name == FIRST_PROGRAM {
            programs_of_readme(&root)?
        } else {
            let folder = root.join(FOLDER).join(&name);
            cargo(&root, &folder, &["fmt", "--check"])? && cargo(&root, &folder, &["test"])?
        };
        if !passed {
            say!("projects: {name} failed")?;
            return Ok(false);
        }
    }
    say!("projects: all passed")?;
    Ok(true)
}

/// Returns the names of the projects, sorted.
fn names(folder: &Path) -> anyhow::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.join("Cargo.toml").exists() {
            names.extend(path.file_name().and_then(|name| name.to_str()).map(str::to_owned));
        }
    }
    names.sort();
    Ok(names)
}

/// Creates a project outside the repository with the README's two programs, and runs them with the
/// workspace's versions of all dependencies.
fn programs_of_readme(root: &Path) -> anyhow::Result<bool> {
    let readme = fs::read_to_string(root.join("README.md"))?;
    let fetch_env = part(&readme, "First program", "`fetch-env = ", "`")?;
    let learner = part(&readme, "Learn", "```toml\n", "```")?;
    let first = part(&readme, "First program", "```rust\n", "```")?;
    let learn = part(&readme, "Learn", "```rust,no_run\n", "```")?;

    let folder = tempfile::tempdir()?;
    let project = folder.path().join("push");
    let new = ["new", "--quiet", "--vcs", "none", "push"];
    if !cargo(root, folder.path(), &new)? {
        return Ok(false);
    }
    let manifest = project.join("Cargo.toml");
    let made = fs::read_to_string(&manifest)?;
    let crates = format!("{}/", root.display());
    let dependencies = format!("fetch-env = {fetch_env}\n{learner}").replace(CRATES, &crates);
    fs::write(&manifest, made + &dependencies)?;
    fs::write(project.join("src/main.rs"), first)?;
    fs::create_dir(project.join("src/bin"))?;
    fs::write(project.join("src/bin/learn.rs"), learn)?;
    fs::copy(root.join("Cargo.lock"), project.join("Cargo.lock"))?;
    Ok(cargo(root, &project, &["run", "--offline", "--bin", "push"])?
        && cargo(root, &project, &["run", "--offline", "--bin", "learn"])?)
}

/// Returns what is between two texts in a section of the README.
fn part<'a>(readme: &'a str, section: &str, start: &str, end: &str) -> anyhow::Result<&'a str> {
    let between = || {
        let (_, section) = readme.split_once(&format!("\n## {section}\n"))?;
        Some(section.split_once(start)?.1.split_once(end)?.0)
    };
    between().with_context(|| format!("the README's section {section} has no {start:?}"))
}

/// Runs cargo in a folder. All projects share one folder of built crates, without what only
/// debuggers and later builds need.
fn cargo(root: &Path, folder: &Path, arguments: &[&str]) -> anyhow::Result<bool> {
    let target: PathBuf = root.join("target/projects");
    let status = Command::new(env!("CARGO"))
        .current_dir(folder)
        .args(arguments)
        .env("CARGO_TARGET_DIR", target)
        .env("CARGO_INCREMENTAL", "0")
        .env("CARGO_PROFILE_DEV_DEBUG", "0")
        .env("RUSTFLAGS", "-D warnings")
        .status()
        .context("cargo did not start")?;
    Ok(status.success())
}
