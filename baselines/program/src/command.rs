//! The commands: the only list of them.

#[cfg(feature = "full")]
use clap::CommandFactory;

use crate::{
    chapter::{all, bridge, describe, doctor, exercise, random_episodes, reward_check, verify},
    install,
};
#[cfg(feature = "full")]
use crate::{
    collect, completions, datasets, evaluate, figures, learning_curves, plan, play, report,
    robustness, shared::tasks::Tasks, train,
};

/// The Fetch environments: step them, check them, learn their tasks, and look at what was learned.
#[derive(clap::Parser)]
#[command(name = "fetch-env", bin_name = "fetch-env", version, no_binary_name = true)]
#[command(after_help = EXIT_CODES)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 if everything passed, 1 if a check failed or could not run, \
    2 for wrong usage, 130 and 143 if Ctrl-C or SIGTERM stopped it in good order.";

#[derive(clap::Subcommand)]
pub enum Command {
    /// Verify every claim of the chapter by stepping the environments
    #[command(after_help = "Example: fetch-env verify --env-id FetchPush-v4")]
    Verify(verify::Args),
    /// Compare hand-computed rewards with the environment's, step by step
    #[command(after_help = "Example: fetch-env bridge --env-id FetchSlide-v4")]
    Bridge(bridge::Args),
    /// Write the observation and action spaces as JSON
    #[command(
        after_help = "Example: fetch-env describe --env-id FetchPush-v4 --describe-out push.json"
    )]
    Describe(describe::Args),
    /// Check that step, compute_reward and the distance formula agree
    #[command(after_help = "Example: fetch-env reward-check --env-id FetchSlideDense-v4")]
    RewardCheck(reward_check::Args),
    /// Run a random policy and write its results as JSON
    #[command(
        after_help = "Example: fetch-env random-episodes --episodes 100 --random-out random.json"
    )]
    RandomEpisodes(random_episodes::Args),
    /// Run describe, reward-check and random-episodes
    #[command(after_help = "Example: fetch-env all --env-id FetchReach-v4")]
    All(all::Args),
    /// Answer one of the chapter's exercises, 1 to 4
    #[command(after_help = "Example: fetch-env exercise 2")]
    Exercise(exercise::Args),
    /// Look for the usual problems, and say how to fix them
    #[command(after_help = "Example: fetch-env doctor")]
    Doctor(doctor::Args),
    /// Train a policy, with its learning curve and a page
    #[cfg(feature = "full")]
    #[command(after_help = "Example: fetch-env train --env-id FetchPush-v4 --out results/push")]
    Train(Box<train::Args>),
    /// Report when runs reached their targets, and plot their curves
    #[cfg(feature = "full")]
    #[command(after_help = "Example: fetch-env learning-curves results/train --out curves")]
    LearningCurves(learning_curves::Args),
    /// Run a policy over many episodes, and print its figures with their 95 % intervals
    #[cfg(feature = "full")]
    #[command(
        after_help = "Example: fetch-env evaluate --env-id FetchPush-v4,FetchSlide-v4 --policy trained"
    )]
    Evaluate(evaluate::Args),
    /// Measure how success depends on noise, delays, mass, friction and the like
    #[cfg(feature = "full")]
    #[command(
        after_help = "Example: fetch-env robustness --env-id FetchPush-v4 --factor observation_noise=0,0.01,0.02,0.05"
    )]
    Robustness(robustness::Args),
    /// Write a page that plays one episode back
    #[cfg(feature = "full")]
    #[command(after_help = "Example: fetch-env play --env-id FetchPush-v4 --policy trained")]
    Play(play::Args),
    /// Plan episodes on exact snapshots: how much of a task can be solved at all
    #[cfg(feature = "full")]
    #[command(after_help = "Example: fetch-env plan --env-id FetchSlide-v4 --starts 5")]
    Plan(plan::Args),
    /// Run a policy, and save its episodes
    #[cfg(feature = "full")]
    #[command(
        after_help = "Example: fetch-env collect --env-id FetchPush-v4 --policy scripted --out push.npz"
    )]
    Collect(collect::Args),
    /// Write data sets of all environments, for Minari and OGBench
    #[cfg(feature = "full")]
    #[command(after_help = "Example: fetch-env datasets --out data --only FetchPush-v4/expert")]
    Datasets(datasets::Args),
    /// Draw the chapter's figures, and Slide's
    #[cfg(feature = "full")]
    #[command(after_help = "Example: fetch-env figures --out figures")]
    Figures(figures::Args),
    /// Write one page with checks, baselines, plots and playbacks
    #[cfg(feature = "full")]
    #[command(after_help = "Example: fetch-env report --out report.html")]
    Report(report::Args),
    /// Fetch another version of MuJoCo, and remember it for builds and programs
    #[command(after_help = "Example: fetch-env mujoco 3.6.0")]
    Mujoco(install::MujocoArgs),
    /// Fetch the reference's model into the cache
    #[command(after_help = "Example: fetch-env assets")]
    Assets(install::AssetsArgs),
    /// Print the completions of a shell
    #[cfg(feature = "full")]
    #[command(after_help = "Example: fetch-env completions bash")]
    Completions(completions::Args),
}

impl Command {
    /// Runs the command, and returns whether everything passed. Those of the chapter are about the
    /// built-in tasks alone.
    pub fn run(&self, #[cfg(feature = "full")] tasks: &impl Tasks) -> anyhow::Result<bool> {
        match self {
            Self::Verify(args) => verify::run(args),
            Self::Bridge(args) => bridge::run(args),
            Self::Describe(args) => describe::run(args),
            Self::RewardCheck(args) => reward_check::run(args),
            Self::RandomEpisodes(args) => random_episodes::run(args),
            Self::All(args) => all::run(args),
            Self::Exercise(args) => exercise::run(args),
            Self::Doctor(args) => doctor::run(args),
            #[cfg(feature = "full")]
            Self::Train(args) => train::run(tasks, args),
            #[cfg(feature = "full")]
            Self::LearningCurves(args) => learning_curves::run(args),
            #[cfg(feature = "full")]
            Self::Evaluate(args) => evaluate::run(tasks, args),
            #[cfg(feature = "full")]
            Self::Robustness(args) => robustness::run(tasks, args),
            #[cfg(feature = "full")]
            Self::Play(args) => play::run(tasks, args),
            #[cfg(feature = "full")]
            Self::Plan(args) => plan::run(tasks, args),
            #[cfg(feature = "full")]
            Self::Collect(args) => collect::run(tasks, args),
            #[cfg(feature = "full")]
            Self::Datasets(args) => datasets::run(tasks, args),
            #[cfg(feature = "full")]
            Self::Figures(args) => figures::run(args),
            #[cfg(feature = "full")]
            Self::Report(args) => report::run(args),
            Self::Mujoco(args) => install::other_mujoco(args),
            Self::Assets(args) => install::assets(args),
            #[cfg(feature = "full")]
            Self::Completions(args) => completions::run(args, &mut Cli::command()),
        }
    }
}
