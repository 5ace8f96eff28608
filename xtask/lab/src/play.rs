//! `play`: one episode as a page that plays it back.

use std::{fs, path::PathBuf};

use anyhow::Context;
use fetch_env::GoalObservation;

use crate::{
    env_choice::EnvArgs,
    page::{document::Document, playback, recording::Recording},
    policy_choice::PolicyChoice,
    report::make_folder_of,
};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    env: EnvArgs,
    /// What acts
    #[arg(long, value_enum, default_value_t = PolicyChoice::Scripted)]
    policy: PolicyChoice,
    /// Where to write the page
    #[arg(long, default_value = "results/playback.html")]
    out: PathBuf,
    /// Also tell every step
    #[arg(long)]
    verbose: bool,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    if args.verbose {
        println!("  step   reward  distance  achieved goal            action");
    }
    let recording =
        Recording::of(args.env.id(), args.policy, args.env.seed, |number, action, step| {
            if args.verbose {
                let info = step.info;
                println!(
                    "  {number:4}  {:7.3}  {:6.3} m  {:6.3?}  {action:5.2?}{}",
                    step.reward,
                    info.distance,
                    step.observation.achieved_goal(),
                    if info.is_success { "  reached" } else { "" },
                );
            }
        })?;
    let title = recording.title().to_owned();
    let mut page = Document::new(&title);
    page.push(&playback::figure(&recording)?);
    make_folder_of(&args.out)?;
    fs::write(&args.out, page.html())
        .with_context(|| format!("cannot write {}", args.out.display()))?;
    println!("play: {title}: {}; wrote {}", recording.outcome(), args.out.display());
    Ok(true)
}
