//! `report`: writes one page with checks, baselines, plots and playbacks.

mod baseline;
mod observations;
mod rewards;
mod workspace;

use std::{num::NonZeroUsize, path::PathBuf};

use crate::chapter::verify::{Group, all_ids, check_environments, failed};
use base64::prelude::{BASE64_STANDARD, Engine};
use baselines::page::{Column, Document, Playback, escape, table};
use fetch_env::{EnvId, Task, make};
use goal_reward::RewardKind;

use self::baseline::evaluate_all;
use crate::{
    figures::Scene,
    shared::{
        check::Check,
        choice::{PolicyChoice, flag_name},
        json::{Versions, write_text},
    },
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
    #[arg(long, default_value = "100")]
    episodes: NonZeroUsize,
    /// Show the checks of this environment only
    #[arg(long)]
    verify_only: Option<EnvId>,
}

/// The sections in their order: the target of links, and the heading.
const SECTIONS: [(&str, &str); 8] = [
    ("scenes", "The four scenes"),
    ("playback", "Episodes, played back"),
    ("verify", "What verify found"),
    ("baseline", "The random baseline against the reference"),
    ("distributions", "How episodes end"),
    ("workspace", "Goals and objects over the workspace"),
    ("rewards", "Dense against sparse reward"),
    ("observations", "Observations"),
];

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let groups = check_environments(&all_ids(args.verify_only), args.seed)?;
    let outcomes = evaluate_all(args.episodes.get(), args.seed)?;
    let bodies = [
        scenes(args.seed)?,
        playbacks(args.seed)?,
        checks(&groups),
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
    write_text(&args.out, &html)?;
    let failed = failed(&groups);
    say!(
        "report: {failed} checks failed; wrote {} ({} kB)",
        args.out.display(),
        html.len() / 1000
    )?;
    Ok(failed == 0)
}

fn introduction(args: &Args) -> String {
    let links: String =
        SECTIONS.iter().map(|(id, heading)| format!("<a href=\"#{id}\">{heading}</a>\n")).collect();
    format!(
        "<p>The Fetch benchmark of goal-conditioned reinforcement learning, simulated by version \
         {} on MuJoCo {}. This page was made by <code>fetch-env report</code> with seed {} and \
         {} episodes of each policy.</p>\n<nav>{links}</nav>\n",
        Versions::current().project,
        Versions::current().mujoco,
        args.seed,
        args.episodes,
    )
}

fn scenes(seed: u64) -> anyhow::Result<String> {
    let mut html = String::from("<div class=\"grid four\">\n");
    for task in Task::ALL {
        let picture = match Scene::after_reset(task, seed)?.png() {
            Ok(png) => format!(
                "<img alt=\"The scene of Fetch{task} after reset\" \
                 src=\"data:image/png;base64,{}\">",
                BASE64_STANDARD.encode(png)
            ),
            Err(reason) => format!("<div class=\"missing\">{}</div>", escape(&reason)),
        };
        let caption = format!("<figcaption>Fetch{task}, after reset</figcaption>");
        html += &format!("<figure class=\"frame\">{picture}{caption}</figure>\n");
    }
    Ok(html + "</div>")
}

fn playbacks(seed: u64) -> anyhow::Result<String> {
    let mut html = String::from("<div class=\"grid wide\">\n");
    for task in Task::ALL {
        let id = EnvId { task, reward: RewardKind::Sparse };
        for choice in [PolicyChoice::Scripted, PolicyChoice::Trained] {
            let mut env = make(id)?;
            let mut policy = choice.policy(&env, seed)?;
            let playback = Playback::record(&mut env, &mut *policy, seed, |_, _, _| ())?;
            let title = format!("{id}, {} policy, seed {seed}", flag_name(choice));
            html += &playback.with_title(&title).html()?;
        }
    }
    Ok(html + "</div>")
}

/// Returns the number of checks, and the checks of each environment to unfold.
fn checks(groups: &[Group]) -> String {
    let all = || groups.iter().flat_map(|group| &group.checks);
    let failed = all().filter(|check| !check.passed).count();
    let mut html = format!(
        "<p>{} checks, each of which steps the environments (<code>fetch-env verify</code>): \
         {}.</p>\n",
        all().count(),
        verdict(failed),
    );
    for group in groups {
        let failed = group.checks.iter().filter(|check| !check.passed).count();
        html += &format!(
            "<details{}><summary>{}: {} checks, {}</summary>\n{}</details>\n",
            if failed > 0 { " open" } else { "" },
            escape(&group.heading),
            group.checks.len(),
            verdict(failed),
            checks_table(&group.checks),
        );
    }
    html
}

fn verdict(failed: usize) -> String {
    match failed {
        0 => "<span class=\"good\">all passed</span>".into(),
        _ => format!("<span class=\"bad\">{failed} failed</span>"),
    }
}

fn checks_table(checks: &[Check]) -> String {
    let mark = |passed| match passed {
        true => "<span class=\"good\">ok</span>",
        false => "<span class=\"bad\">failed</span>",
    };
    let rows = checks
        .iter()
        .map(|check| [mark(check.passed).into(), escape(&check.name), escape(&check.seen)]);
    table([Column::Text(""), Column::Text("Check"), Column::Text("Seen")], rows)
}
