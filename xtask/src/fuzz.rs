//! `fuzz`: runs the fuzz targets for a bounded time.

use std::{num::NonZeroU32, path::Path, process::Command};

use anyhow::Context;

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

#[derive(clap::Args)]
pub struct Args {
    /// Run each target this long
    #[arg(long, default_value = "15")]
    seconds: NonZeroU32,
    /// Run only this target: load, npz, ogbench or operations of the buffer, values or calls of
    /// environments, settings, checkpoints or minari of training
    #[arg(long, value_parser = known_target)]
    target: Option<Target>,
}

fn known_target(name: &str) -> Result<Target, String> {
    let known = TARGETS.into_iter().find(|target| target.name == name);
    known.ok_or_else(|| format!("the targets are {}", TARGETS.map(|target| target.name).join(", ")))
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let targets = args.target.map_or_else(|| TARGETS.to_vec(), |target| vec![target]);
    for target in targets {
        if !target.fuzz(args.seconds.get())? {
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
