//! The commands that step environments: `cargo xtask <command>` hands them on to this program.
//!
//! Exit codes: 0 if everything passed, 1 if a check failed or could not be made, 2 for wrong usage.
#![forbid(unsafe_code)]
#![allow(unreachable_pub, reason = "a binary's items are public to its own modules only")]

#[macro_use]
#[path = "../../src/output.rs"]
mod output;

mod all;
mod bench;
mod bridge;
mod collect;
mod describe;
mod doctor;
mod exercise;
mod figures;
mod learning_curves;
mod parity;
mod play;
mod random_episodes;
mod report;
mod reward_check;
mod shared;
mod soak;
mod train;
mod verify;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    about = "The commands of the Fetch environments"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Verify every claim of the chapter by stepping the environments
    Verify(verify::Args),
    /// Compare hand-computed rewards with the environment's, step by step
    Bridge(bridge::Args),
    /// Write the observation and action spaces as JSON
    Describe(describe::Args),
    /// Check that step, compute_reward and the distance formula agree
    RewardCheck(reward_check::Args),
    /// Run a random policy and write its results as JSON
    RandomEpisodes(random_episodes::Args),
    /// Run describe, reward-check and random-episodes
    All(all::Args),
    /// Answer one of the chapter's exercises, 1 to 4
    Exercise(exercise::Args),
    /// Replay recordings of the real environment and compare
    Parity(parity::Args),
    /// Measure speed and memory
    Bench(bench::Args),
    /// Draw the chapter's pictures, and Slide's
    Figures(figures::Args),
    /// Write one page with checks, baselines, plots and playbacks
    Report(report::Args),
    /// Write a page that plays one episode back
    Play(play::Args),
    /// Run a policy, and save its episodes
    Collect(collect::Args),
    /// Train a policy, with its learning curve and a page
    Train(Box<train::Args>),
    /// Gather runs, tell when they reached their targets, and draw their curves
    LearningCurves(learning_curves::Args),
    /// Step, save and draw environments for a long time, and look for what they leave behind
    Soak(soak::Args),
    /// Look for the usual problems, and say how to fix them
    Doctor(doctor::Args),
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Verify(args) => verify::run(&args),
        Command::Bridge(args) => bridge::run(&args),
        Command::Describe(args) => describe::run(&args),
        Command::RewardCheck(args) => reward_check::run(&args),
        Command::RandomEpisodes(args) => random_episodes::run(&args),
        Command::All(args) => all::run(&args),
        Command::Parity(args) => parity::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Exercise(args) => exercise::run(&args),
        Command::Figures(args) => figures::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Play(args) => play::run(&args),
        Command::Collect(args) => collect::run(&args),
        Command::Train(args) => train::run(&args),
        Command::LearningCurves(args) => learning_curves::run(&args),
        Command::Soak(args) => soak::run(&args),
        Command::Doctor(args) => doctor::run(&args),
    };
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => output::end_with(&error),
    }
}
