//! `bench`: how fast it is. Contenders take turns within one run, so that ratios hold on a busy
//! machine; absolute figures want a quiet one.

mod env;
mod instructions;
mod interleaved;
mod reward;
mod subject;

#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: Benchmark,
}

#[derive(clap::Subcommand)]
enum Benchmark {
    /// Stepping and resetting environments, their construction and their memory
    Env(env::Args),
    /// Instructions of a step and a reset, counted by valgrind
    Instructions(instructions::Args),
    /// Rewards of a million pairs of goals, against copying as many bytes
    Reward(reward::Args),
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    match &args.what {
        Benchmark::Env(args) => env::run(args),
        Benchmark::Instructions(args) => instructions::run(args),
        Benchmark::Reward(args) => reward::run(args),
    }
}
