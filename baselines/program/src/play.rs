//! `play`: writes a page that plays one episode back.

use std::path::PathBuf;

use baselines::page::{Document, Playback};
use clap::ValueEnum;
use fetch_env::{EnvId, GoalObservation, Info, Step};

use crate::shared::{
    choice::{PIXELS, PolicyChoice, pixel_policy_of, policy_of},
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
    /// pixels (sees pictures), zero, or the file of a trained one
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
    if args.verbose {
        say!("  step   reward  distance  achieved goal            action")?;
    }
    let mut said = Ok(());
    let playback = if let Some(mut policy) = pixel_policy_of(&args.policy, id.task)? {
        Playback::record_seen(env, &mut policy, seed, |number, action, step| {
            say_step(args, &mut said, number, action, step);
        })?
    } else {
        let mut policy = policy_of(&args.policy, &env, seed)?;
        Playback::record(&mut env, &mut *policy, seed, |number, action, step| {
            say_step(args, &mut said, number, action, step);
        })?
    };
    said?;
    let title = format!("{id}, {} policy, seed {seed}", name(&args.policy));
    let playback = playback.with_title(&title);
    let mut page = Document::new(&title);
    page.push(&playback.html()?);
    write_text(&args.out, &page.html())?;
    say!("play: {title}: {}; wrote {}", playback.outcome(), args.out.display())?;
    Ok(true)
}

/// Prints a step, if the flags ask for it.
fn say_step(
    args: &Args,
    said: &mut anyhow::Result<()>,
    number: usize,
    action: &[f32],
    step: &Step<impl GoalObservation, Info>,
) {
    if args.verbose && said.is_ok() {
        *said = say!(
            "  {number:4}  {:7.3}  {:6.3} m  {:6.3?}  {action:5.2?}{}",
            step.reward,
            step.info.distance,
            step.observation.achieved_goal(),
            if step.info.is_success { "  reached" } else { "" },
        );
    }
}

/// Returns the name of a policy in titles.
fn name(text: &str) -> &str {
    let is_name = PolicyChoice::from_str(text, false).is_ok()
        || text == PIXELS
        || text.starts_with("proportional=");
    if is_name { text } else { "trained" }
}
