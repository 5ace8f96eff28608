//! `exercise`: the chapter's exercises 1 to 4, answered by running them.

mod observations;
mod push;
pub mod rewards;
mod thresholds;

#[derive(clap::Args)]
pub struct Args {
    /// Which exercise
    #[arg(value_parser = clap::value_parser!(u8).range(1..=4))]
    number: u8,
    /// Seed of the first reset, and of the random policy
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    match args.number {
        1 => observations::run(args.seed),
        2 => rewards::run(args.seed),
        3 => push::run(args.seed),
        _ => thresholds::run(args.seed),
    }
}
