//! `play`: writes a page that plays one episode back.

use std::path::PathBuf;

use baselines::page::{Document, Playback};
use clap::ValueEnum;
use fetch_env::{EnvId, GoalObservation};

use crate::shared::{
    choice::{PolicyChoice, policy_of},
    env_id::parse_env_id,
    json::write_text,
    tasks::Tasks,
};

#[derive(clap::Args)]
pub struct Args {
    /// Environment, or auto for FetchReachDense-v4
    #[arg(long, default_value = "auto", value_parser = parse_env_id)]
    env_id: EnvId,
    /// Seed of the reset, and of the random policy
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Policy that acts: random, proportional (or proportional=GAIN), scripted, trained, robust,
    /// zero, or the file of a trained one
    #[arg(long, default_value = "scripted")]
    policy: String,
    /// Where to write the page
    #[arg(long, default_value = "results/playback.html")]
    out: PathBuf,
    /// Also print every step
    #[arg(long)]
    verbose: bool,
}

pub fn run(tasks: &impl Tasks, args: &Args) -> anyhow::Result<bool> {
    let (id, seed) = (args.env_id, args.seed);
    let mut env = tasks.make(id.config())?;
    let mut policy = policy_of(&args.policy, &env, seed)?;
    if args.verbose {
        say!("  step   reward  distance  achieved goal            action")?;
    }
    let mut said = Ok(());
    let playback = Playback::record(&mut env, &mut *policy, seed, |number, action, step| {
        if args.verbose && said.is_ok() {
            let info = step.info;
            said = say!(
                "  {number:4}  {:7.3}  {:6.3} m  {:6.3?}  {action:5.2?}{}",
                step.reward,
                info.distance,
                step.observation.achieved_goal(),
                if info.is_success { "  reached" } else { "" },
            );
        }
    })?;
    said?;
    let title = format!("{id}, {} policy, seed {seed}", name(&args.policy));
    let playback = playback.with_title(&title);
    let mut page = Document::new(&title);
    page.push(&playback.html()?);
    write_text(&args.out, &page.html())?;
    say!("play: {title}: {}; wrote {}", playback.outcome(), args.out.display())?;
    Ok(true)
}

/// Returns the name of a policy in titles.
fn name(text: &str) -> &str {
    let is_name = PolicyChoice::from_str(text, false).is_ok() || text.starts_with("proportional=");
    if is_name { text } else { "trained" }
}
