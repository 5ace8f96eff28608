//! `fuzz`: the fuzz targets of her-relabel, for a bounded time.

use std::{path::Path, process::Command};

use anyhow::Context;

/// The folder of the fuzz targets. Its configuration of cargo makes them: see there.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../her-relabel/fuzz");

const TARGETS: [&str; 3] = ["load", "npz", "operations"];

#[derive(clap::Args)]
pub struct Args {
    /// How long each target runs
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..))]
    seconds: u32,
    /// The only target to run: load, npz or operations
    #[arg(long, value_parser = TARGETS)]
    target: Option<String>,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    for target in TARGETS {
        if args.target.as_ref().is_some_and(|only| only != target) {
            continue;
        }
        let corpus = Path::new(FOLDER).join("corpus").join(target);
        let artifacts = Path::new(FOLDER).join("artifacts").join(target);
        for folder in [&corpus, &artifacts] {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("{} cannot be made", folder.display()))?;
        }
        let status = Command::new(env!("CARGO"))
            .current_dir(FOLDER)
            .args(["run", "--release", "--quiet", "--bin", target, "--"])
            .arg(&corpus)
            .arg(format!("-artifact_prefix={}/", artifacts.display()))
            .arg(format!("-max_total_time={}", args.seconds))
            .args(["-rss_limit_mb=1024", "-timeout=10", "-print_final_stats=1", "-verbosity=0"])
            .status()
            .context("cargo did not start")?;
        if !status.success() {
            println!(
                "fuzz {target}: failed; run `cargo run --release --bin {target} -- FILE` in {FOLDER}"
            );
            return Ok(false);
        }
        println!("fuzz {target}: nothing found in {} s", args.seconds);
    }
    Ok(true)
}
