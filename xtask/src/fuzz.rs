//! `fuzz`: runs the fuzz targets of her-relabel for a bounded time.

use std::{num::NonZeroU32, path::Path, process::Command};

use anyhow::Context;
use lexopt::{Arg::Long, Parser, ValueExt};

/// Folder of the fuzz targets, which has a cargo configuration of its own.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../her-relabel/fuzz");

const TARGETS: [&str; 3] = ["load", "npz", "operations"];

pub fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    let (mut seconds, mut only) = (15, None);
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("seconds") => {
                seconds = arguments.value()?.parse_with(str::parse::<NonZeroU32>)?.get()
            }
            Long("target") => {
                only = Some(arguments.value()?.parse_with(|name| {
                    let known = TARGETS.into_iter().find(|target| *target == name);
                    known.ok_or_else(|| format!("the targets are {}", TARGETS.join(", ")))
                })?);
            }
            other => return Err(other.unexpected().into()),
        }
    }
    for target in TARGETS {
        if only.is_some_and(|only| only != target) {
            continue;
        }
        let corpus = Path::new(FOLDER).join("corpus").join(target);
        let artifacts = Path::new(FOLDER).join("artifacts").join(target);
        for folder in [&corpus, &artifacts] {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("cannot make {}", folder.display()))?;
        }
        let status = Command::new(env!("CARGO"))
            .current_dir(FOLDER)
            .args(["run", "--release", "--quiet", "--bin", target, "--"])
            .arg(&corpus)
            .arg(format!("-artifact_prefix={}/", artifacts.display()))
            .arg(format!("-max_total_time={}", seconds))
            .args(["-rss_limit_mb=1024", "-timeout=10", "-print_final_stats=1", "-verbosity=0"])
            .status()
            .context("cargo did not start")?;
        if !status.success() {
            say!(
                "fuzz {target}: failed; run `cargo run --release --bin {target} -- FILE` in {FOLDER}"
            )?;
            return Ok(false);
        }
        say!("fuzz {target}: nothing found in {} s", seconds)?;
    }
    Ok(true)
}
