//! `report`: one page to look at.

mod baseline;
mod checks;
pub mod document;
mod evaluations;
mod observations;
pub mod playback;
mod plot;
pub mod recording;
mod rewards;
mod scenes;
mod workspace;

use std::{fs, path::PathBuf};

use anyhow::{Context, ensure};
use fetch_env::{EnvId, Task};
use goal_reward::RewardKind;
use rayon::prelude::*;

use self::{document::Document, evaluations::Outcome, recording::Recording};
use crate::{
    policy_choice::PolicyChoice,
    progress,
    report::{Versions, make_folder_of},
    verify::{all_ids, check_environments, failed},
};

#[derive(clap::Args)]
pub struct Args {
    /// Where to write the page
    #[arg(long, default_value = "results/report.html")]
    out: PathBuf,
    /// Seed of resets, actions and goals
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Episodes of each policy in each environment
    #[arg(long, default_value_t = 100)]
    episodes: usize,
    /// Only this environment in the part about verify
    #[arg(long)]
    verify_only: Option<EnvId>,
}

/// The sections, in their order: what a link goes to, and what it is called.
const SECTIONS: [(&str, &str); 8] = [
    ("scenes", "The four scenes"),
    ("playback", "Episodes, played back"),
    ("verify", "What verify found"),
    ("baseline", "The random baseline against the reference"),
    ("distributions", "How episodes end"),
    ("workspace", "Goals and objects over the workspace"),
    ("rewards", "Dense against sparse reward"),
    ("observations", "What is observed"),
];

pub fn run(args: &Args) -> anyhow::Result<bool> {
    ensure!(args.episodes > 0, "--episodes must be at least 1");
    make_folder_of(&args.out)?;
    let groups = check_environments(&all_ids(args.verify_only), args.seed)?;
    let outcomes = evaluate_all(args.episodes, args.seed)?;
    let bodies = [
        scenes::section(args.seed)?,
        playbacks(args.seed)?,
        checks::section(&groups),
        baseline::against_reference(&outcomes)?,
        baseline::distributions(&outcomes)?,
        workspace::section(args.seed)?,
        rewards::section(args.seed)?,
        observations::section(&outcomes),
    ];

    let mut page = Document::new("Fetch environments");
    page.push(&introduction(args));
    for ((id, heading), body) in SECTIONS.into_iter().zip(bodies) {
        page.section(id, heading, &body);
    }
    let html = page.html();
    fs::write(&args.out, &html).with_context(|| format!("cannot write {}", args.out.display()))?;
    let failed = failed(&groups);
    println!(
        "report: {failed} checks failed; wrote {} ({} kB)",
        args.out.display(),
        html.len() / 1000
    );
    Ok(failed == 0)
}

fn introduction(args: &Args) -> String {
    let links: String =
        SECTIONS.iter().map(|(id, heading)| format!("<a href=\"#{id}\">{heading}</a>\n")).collect();
    format!(
        "<p>The Fetch benchmark of goal-conditioned reinforcement learning, as version {} simulates \
         it on MuJoCo {}. Made by <code>cargo xtask report</code> with seed {} and {} episodes of \
         each policy.</p>\n<nav>{links}</nav>\n",
        Versions::current().project,
        Versions::current().mujoco,
        args.seed,
        args.episodes,
    )
}

/// The random policy in all eight environments, the scripted one in those with dense reward.
fn evaluate_all(episodes: usize, seed: u64) -> anyhow::Result<Vec<Outcome>> {
    let random = EnvId::ALL.map(|id| (id, PolicyChoice::Random));
    let scripted =
        Task::ALL.map(|task| (EnvId { task, reward: RewardKind::Dense }, PolicyChoice::Scripted));
    let all: Vec<_> = random.into_iter().chain(scripted).collect();
    let bar = progress::bar(all.len(), "baselines");
    let outcomes = all
        .into_par_iter()
        .map(|(id, policy)| {
            let outcome = Outcome::of(id, policy, episodes, seed)?;
            bar.inc(1);
            progress::note(&bar, format_args!("evaluated {id}, {} policy", policy.name()));
            Ok(outcome)
        })
        .collect();
    bar.finish_and_clear();
    outcomes
}

/// One scripted episode a task.
fn playbacks(seed: u64) -> anyhow::Result<String> {
    let mut html = String::from("<div class=\"grid wide\">\n");
    for task in Task::ALL {
        let id = EnvId { task, reward: RewardKind::Sparse };
        let recording = Recording::of(id, PolicyChoice::Scripted, seed, |_, _, _| ())?;
        html += &playback::figure(&recording)?;
    }
    Ok(html + "</div>")
}
