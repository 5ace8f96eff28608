//! `packages`: checks that the library crates are ready to be published.

use std::{fs, path::Path, process::Command};

use anyhow::{Context, ensure};

use crate::tools::{NIGHTLY, ROOT, cargo, install_toolchain, on_toolchain, succeeds, tool};

/// The library crates, by folder and by package.
const CRATES: [(&str, &str); 6] = [
    ("goal-reward", "goal-reward"),
    ("fetch-sim/install", "fetch-install"),
    ("fetch-sim", "fetch-sim"),
    ("fetch-env", "fetch-env"),
    ("her-relabel", "her-relabel"),
    ("baselines", "fetch-baselines"),
];

/// The tools that the checks need, and their versions.
const MACHETE: (&str, &str) = ("cargo-machete", "0.9.2");
const DENY: (&str, &str) = ("cargo-deny", "0.20.2");
const HACK: (&str, &str) = ("cargo-hack", "0.6.46");
const PUBLIC_API: (&str, &str) = ("cargo-public-api", "0.52.0");

#[derive(clap::Args)]
pub struct Args {
    /// Write the public interface to each crate's public-api.txt instead of comparing it
    #[arg(long)]
    bless: bool,
    /// Also build the crates from their packages
    #[arg(long)]
    build: bool,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    Ok(has_no_unused_dependency()?
        && has_the_allowed_dependencies()?
        && is_clean_with_each_feature()?
        && builds_with_the_oldest_rust()?
        && has_the_known_interface(args.bless)?
        && can_be_published(args.build)?)
}

fn has_no_unused_dependency() -> anyhow::Result<bool> {
    succeeds(Command::new(tool(MACHETE)?).arg("--skip-target-dir").arg(ROOT))
}

/// Checks licenses and sources of all dependencies by `.cargo/deny.toml`.
fn has_the_allowed_dependencies() -> anyhow::Result<bool> {
    let arguments = ["--all-features", "check", "bans", "licenses", "sources"];
    succeeds(Command::new(tool(DENY)?).args(arguments).current_dir(ROOT))
}

/// Lints each crate without features, with each one alone, and with all of them.
fn is_clean_with_each_feature() -> anyhow::Result<bool> {
    let mut hack = Command::new(tool(HACK)?);
    hack.args(["hack", "clippy", "--each-feature", "--quiet"]).current_dir(ROOT);
    // What all formats of data sets share is unused without one of them.
    hack.args(["--exclude-features", "datasets"]);
    for (_, package) in CRATES {
        hack.args(["-p", package]);
    }
    succeeds(hack.args(["--", "-D", "warnings"]))
}

/// Builds with the `rust-version` of the packages. Without rustup, only clippy's lint
/// `incompatible_msrv` checks it.
fn builds_with_the_oldest_rust() -> anyhow::Result<bool> {
    let manifest = fs::read_to_string(Path::new(ROOT).join("Cargo.toml"))?;
    let version = manifest
        .lines()
        .find_map(|line| line.strip_prefix("rust-version = \"")?.strip_suffix('"'))
        .context("the root Cargo.toml has no rust-version")?;
    if !install_toolchain(version, &[])? {
        say!("rustup cannot install Rust {version}, so the build with it was skipped")?;
        return Ok(true);
    }
    let mut check = on_toolchain(version, "check");
    for (_, package) in CRATES {
        check.args(["-p", package]);
    }
    succeeds(check.arg("--all-features"))
}

/// Compares the public interface of each crate with its `public-api.txt`, or writes that file.
fn has_the_known_interface(bless: bool) -> anyhow::Result<bool> {
    let program = tool(PUBLIC_API)?;
    if !install_toolchain(NIGHTLY, &[])? {
        say!("rustup cannot install {NIGHTLY}, so public interfaces were not compared")?;
        return Ok(true);
    }
    let mut is_known = true;
    for (folder, package) in CRATES {
        let output = Command::new(&program)
            .args(["public-api", "--all-features", "-sss", "-p", package])
            .current_dir(ROOT)
            .env("RUSTDOCFLAGS", "")
            .env("RUSTUP_TOOLCHAIN", NIGHTLY)
            .output()
            .with_context(|| format!("{} did not start", program.display()))?;
        let errors = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "the interface of {package} cannot be listed: {errors}");
        let path = Path::new(ROOT).join(folder).join("public-api.txt");
        if bless {
            fs::write(&path, &output.stdout)?;
            continue;
        }
        let known = fs::read_to_string(&path).unwrap_or_default();
        let found = String::from_utf8(output.stdout)?;
        for (sign, lines, others) in [("-", &known, &found), ("+", &found, &known)] {
            for line in lines.lines().filter(|line| !others.lines().any(|other| other == *line)) {
                is_known = false;
                say!("{sign} {line}")?;
            }
        }
    }
    if !is_known {
        say!(
            "the public interface has changed: if that is intended, say so in CHANGELOG.md and run \
             `cargo xtask packages --bless`"
        )?;
    }
    Ok(is_known)
}

/// Packs the crates, and builds them from their packages if asked to, as publishing does.
fn can_be_published(build: bool) -> anyhow::Result<bool> {
    // Cargo unpacks packages once for each target folder and version, so an old folder would give
    // it the sources of an earlier run.
    let folder = tempfile::tempdir_in(Path::new(ROOT).join("target"))?;
    let mut publish = cargo();
    publish.args(["publish", "--workspace", "--dry-run", "--quiet", "--allow-dirty"]);
    if !build {
        publish.arg("--no-verify");
    }
    succeeds(publish.arg("--target-dir").arg(folder.path()))
}
