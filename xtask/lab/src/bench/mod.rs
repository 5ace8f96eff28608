//! `bench`: measures speed and memory. Contenders take turns within one run, so that ratios hold on a
//! busy machine; absolute figures need a quiet one.

mod env;
mod her;
mod instructions;
mod interleaved;
mod memory;
mod peer;
mod render;
mod reward;
mod subject;

#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: Benchmark,
}

#[derive(clap::Subcommand)]
enum Benchmark {
    /// Measure steps and resets of environments, their construction and memory
    Env(env::Args),
    /// Measure sampling from the replay buffer, adding to it, and its memory
    Her(her::Args),
    /// Count the instructions of a step and a reset with valgrind
    Instructions(instructions::Args),
    /// Measure pictures per second, against those of the sky alone
    Render(render::Args),
    /// Measure rewards of a million pairs of goals, against copying as many bytes
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
