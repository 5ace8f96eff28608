//! `fuzz`: runs the fuzz targets for a bounded time.

use std::{num::NonZeroU32, path::Path, process::Command};

use anyhow::Context;
use lexopt::{Arg::Long, Parser, ValueExt};

use crate::tools::ROOT;

/// A fuzz target.
#[derive(Clone, Copy)]
struct Target {
    name: &'static str,
    /// The crate whose folder `fuzz` has it, a workspace with its own cargo configuration.
    of: &'static str,
}

const TARGETS: [Target; 9] = [
    Target { name: "load", of: "her-relabel" },
    Target { name: "npz", of: "her-relabel" },
    Target { name: "ogbench", of: "her-relabel" },
    Target { name: "operations", of: "her-relabel" },
    Target { name: "values", of: "fetch-env" },
    Target { name: "calls", of: "fetch-env" },
    Target { name: "settings", of: "baselines" },
    Target { name: "checkpoints", of: "baselines" },
    Target { name: "minari", of: "baselines" },
];

pub fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    let (mut seconds, mut targets) = (15, TARGETS.to_vec());
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("seconds") => {
                seconds = arguments.value()?.parse_with(str::parse::<NonZeroU32>)?.get()
            }
            Long("target") => {
                let only = arguments.value()?.parse_with(|name| {
                    let known = TARGETS.into_iter().find(|target| target.name == name);
                    known.ok_or_else(|| {
                        let names = TARGETS.map(|target| target.name);
                        format!("the targets are {}", names.join(", "))
                    })
                })?;
                targets = vec![only];
            }
            other => return Err(other.unexpected().into()),
        }
    }
    for target in targets {
        if !target.fuzz(seconds)? {
            return Ok(false);
        }
    }
    Ok(true)
}

impl Target {
    /// Returns whether nothing was found.
    fn fuzz(self, seconds: u32) -> anyhow::Result<bool> {
        let Self { name, of } = self;
        let folder = Path::new(ROOT).join(of).join("fuzz");
        // New inputs are added to the first corpus; the committed one has the seeds.
        let [found, seeds, artifacts] =
            ["target/corpus", "corpus", "artifacts"].map(|part| folder.join(part).join(name));
        for folder in [&found, &seeds, &artifacts] {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("cannot make {}", folder.display()))?;
        }
        let status = Command::new(env!("CARGO"))
            .current_dir(&folder)
            // The workspaces have dependencies, flags and a profile in common.
            .env("CARGO_TARGET_DIR", Path::new(ROOT).join("target/fuzz"))
            .args(["run", "--release", "--quiet", "--bin", name, "--"])
            .args([&found, &seeds])
            .arg(format!("-artifact_prefix={}/", artifacts.display()))
            .arg(format!("-max_total_time={seconds}"))
            .args(["-rss_limit_mb=1024", "-timeout=10", "-print_final_stats=1", "-verbosity=0"])
            .status()
            .context("cargo did not start")?;
        if status.success() {
            say!("fuzz {name}: nothing found in {seconds} s")?;
        } else {
            let folder = folder.display();
            say!(
                "fuzz {name}: failed; run `cargo run --release --bin {name} -- FILE` in {folder}"
            )?;
        }
        Ok(status.success())
    }
}
