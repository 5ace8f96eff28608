//! `bench`: how fast it is. Contenders take turns within one run, so that ratios hold on a busy
//! machine; absolute figures want a quiet one.

mod env;
mod her;
mod instructions;
mod interleaved;
mod peer;
mod render;
mod reward;
mod subject;

use std::fs;

use anyhow::Context;

#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: Benchmark,
}

#[derive(clap::Subcommand)]
enum Benchmark {
    /// Stepping and resetting environments, their construction and their memory
    Env(env::Args),
    /// Sampling from the replay buffer, adding to it, and its memory
    Her(her::Args),
    /// Instructions of a step and a reset, counted by valgrind
    Instructions(instructions::Args),
    /// Pictures a second, against those of the sky alone
    Render(render::Args),
    /// Rewards of a million pairs of goals, against copying as many bytes
    Reward(reward::Args),
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    match &args.what {
        Benchmark::Env(args) => env::run(args),
        Benchmark::Her(args) => her::run(args),
        Benchmark::Instructions(args) => instructions::run(args),
        Benchmark::Render(args) => render::run(args),
        Benchmark::Reward(args) => reward::run(args),
    }
}

/// The memory of this process that is in RAM.
fn resident_bytes() -> anyhow::Result<f64> {
    let status = fs::read_to_string("/proc/self/status").context("memory is measured on Linux")?;
    let kilobytes = status
        .lines()
        .find_map(|line| line.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB"))
        .context("/proc/self/status has no VmRSS")?;
    Ok(kilobytes.trim().parse::<f64>()? * 1024.0)
}
