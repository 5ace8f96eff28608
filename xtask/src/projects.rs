//! `projects`: builds and tests the projects outside the workspace, as their users would, and the
//! program in the README's section on depending on the crates.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, ensure};

use crate::output::usage;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const FOLDER: &str = "fetch-env/projects";
const FIRST_PROGRAM: &str = "quickstart";
/// The README's section with the first program, and the path of the crates in its dependencies.
const SECTION: &str = "## Use it from your project\n";
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
            program_of_readme(&root)?
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

/// Creates the program of the README's [`SECTION`] in a new project outside the repository and runs it, with the
/// workspace's versions of all dependencies.
fn program_of_readme(root: &Path) -> anyhow::Result<bool> {
    let readme = fs::read_to_string(root.join("README.md"))?;
    let section =
        readme.split_once(SECTION).context("the README has no section with this program")?.1;
    let block = |language: &str| {
        let (_, rest) = section.split_once(&format!("```{language}\n"))?;
        Some(rest.split_once("```")?.0)
    };
    let (dependencies, program) =
        block("toml").zip(block("rust")).context("the README's section has no program")?;
    let lines = program.lines().count();
    ensure!(lines <= 30, "the program in the README has {lines} lines: the limit is 30");

    let folder = tempfile::tempdir()?;
    let project = folder.path().join("push");
    let new = ["new", "--quiet", "--vcs", "none", "push"];
    if !cargo(root, folder.path(), &new)? {
        return Ok(false);
    }
    let manifest = project.join("Cargo.toml");
    let made = fs::read_to_string(&manifest)?.replace("[dependencies]\n", "");
    let crates = format!("{}/", root.display());
    fs::write(&manifest, made + &dependencies.replace(CRATES, &crates))?;
    fs::write(project.join("src/main.rs"), program)?;
    fs::copy(root.join("Cargo.lock"), project.join("Cargo.lock"))?;
    cargo(root, &project, &["run", "--offline"])
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
