//! The commands of the workspace: `cargo xtask <command>`.
//!
//! Exit codes: 0 if everything passed, 1 if a check failed or could not be made, 2 for wrong usage.
#![forbid(unsafe_code)]
// A command line speaks to its user, and a binary's items are public to its own modules only.
#![allow(clippy::print_stdout, clippy::print_stderr, unreachable_pub)]

mod all;
mod assets;
mod bench;
mod bridge;
mod check;
mod ci;
mod describe;
mod doctor;
mod env_choice;
mod exercise;
mod figures;
mod fuzz;
mod mujoco;
mod page;
mod parity;
mod play;
mod policy_choice;
mod progress;
mod python;
mod random_episodes;
mod report;
mod reward_check;
mod verify;
mod wheel;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cargo xtask", about = "The commands of the Fetch environments")]
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
    /// Run a random policy and write what it achieves as JSON
    RandomEpisodes(random_episodes::Args),
    /// describe, reward-check and random-episodes in one go
    All(all::Args),
    /// Fetch the reference's model into the cache
    Assets(assets::Args),
    /// Fetch another version of MuJoCo into the cache
    Mujoco(mujoco::Args),
    /// Replay recordings of the real environment and compare
    Parity(parity::Args),
    /// Measure how fast it is
    Bench(bench::Args),
    /// Answer one of the chapter's exercises, 1 to 4
    Exercise(exercise::Args),
    /// Make the chapter's pictures, and Slide's
    Figures(figures::Args),
    /// Fuzz the replay buffer's file formats and sequences of its calls
    Fuzz(fuzz::Args),
    /// Write one page to look at: checks, baselines, plots and playbacks
    Report(page::Args),
    /// Write a page that plays one episode back
    Play(play::Args),
    /// Look for the usual troubles, and say how to mend them
    Doctor(doctor::Args),
    /// What continuous integration runs, cheapest checks first
    Ci(ci::Args),
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Verify(args) => verify::run(&args),
        Command::Bridge(args) => bridge::run(&args),
        Command::Describe(args) => describe::run(&args),
        Command::RewardCheck(args) => reward_check::run(&args),
        Command::RandomEpisodes(args) => random_episodes::run(&args),
        Command::All(args) => all::run(&args),
        Command::Assets(args) => assets::run(&args),
        Command::Mujoco(args) => mujoco::run(&args),
        Command::Parity(args) => parity::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Exercise(args) => exercise::run(&args),
        Command::Figures(args) => figures::run(&args),
        Command::Fuzz(args) => fuzz::run(&args),
        Command::Report(args) => page::run(&args),
        Command::Play(args) => play::run(&args),
        Command::Doctor(args) => doctor::run(&args),
        Command::Ci(args) => ci::run(&args),
    };
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
