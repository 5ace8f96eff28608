//! `bench env`: measures steps, resets, and the construction and memory of environments.

pub(super) mod contenders;
pub(super) mod episodes;
mod footprint;

use std::{path::PathBuf, sync::Arc, thread, time::Duration};

use fetch_env::EnvId;
use goal_reward::RewardKind;
use serde::Serialize;

use self::{
    contenders::{Apart, BareLoop, BareResets, Resets, Single, Together},
    episodes::{Episodes, STEPS},
    footprint::Footprint,
};
use super::{
    interleaved::{
        Clock::{Cpu, Wall},
        Entry, Rounds, interleave,
    },
    peer::{Orders, Peer, note_other_mujoco},
    subject::{Subject, Subjects},
};
use crate::shared::{
    json::{Metric, write_results},
    python,
};

#[derive(Debug, clap::Args, Serialize)]
pub struct Args {
    #[command(flatten)]
    #[serde(flatten)]
    subjects: Subjects,
    /// Seconds for the steps of each task and model
    #[arg(long, default_value_t = 10.0, value_parser = parse_seconds)]
    seconds: f64,
    /// Number of environments stepped together
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..))]
    num_envs: u16,
    /// Also measure gymnasium-robotics and EnvPool, in a Python environment in the cache
    #[arg(long)]
    peers: bool,
    /// Also write the figures as JSON
    #[arg(long)]
    #[serde(skip)]
    json: Option<PathBuf>,
    /// Number of environments whose construction and memory are measured
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u16).range(2..))]
    footprint_envs: u16,
    /// Measure construction and memory in this process, and print them
    #[arg(long, hide = true, requires_all = ["task", "model"])]
    #[serde(skip)]
    footprint: bool,
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|error| format!("{error}"))?;
    let sensible = (0.0..=86_400.0).contains(&seconds);
    sensible.then_some(seconds).ok_or_else(|| "give 0 to 86400 seconds".into())
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let subjects = args.subjects.all();
    if args.footprint {
        let measured = Footprint::measure(&subjects[0].config()?, args.footprint_envs)?;
        println!("{}", serde_json::to_string(&measured)?);
        return Ok(true);
    }
    if args.peers {
        note_other_mujoco()?;
    }
    let mut figures = Vec::new();
    for subject in subjects {
        for (name, figure) in measure(args, subject)? {
            let name = format!("env/{subject}/{name}");
            println!("{name:<54} {figure}");
            figures.push((name, figure));
        }
    }
    write_results(args.json.as_ref(), args, figures)?;
    Ok(true)
}

fn measure(args: &Args, subject: Subject) -> anyhow::Result<Vec<(String, Metric)>> {
    let episodes = Episodes::new(subject.config()?)?;
    let steps = interleave(steppers(args, &episodes)?, Duration::from_secs_f64(args.seconds))?;
    let resets = vec![
        Entry::new("reset", "resets/s", Resets(Single::new(&episodes)?)),
        Entry::new("reset-bare", "resets/s", BareResets(BareLoop::new(&episodes)?)),
    ];
    let resets = interleave(resets, Duration::from_secs_f64(args.seconds / 10.0))?;
    let mut figures: Vec<_> = steps.figures().chain(resets.figures()).collect();
    figures.extend(ratios(&steps, &resets));
    let footprint = Footprint::of(subject, args.footprint_envs)?;
    figures.extend([
        (format!("construction-{}", args.footprint_envs), Metric::new(footprint.construction, "s")),
        ("memory-further-env".into(), Metric::new(footprint.further_env, "bytes")),
    ]);
    Ok(figures)
}

fn steppers(args: &Args, episodes: &Arc<Episodes>) -> anyhow::Result<Vec<Entry>> {
    const UNIT: &str = "steps/s";
    let num_envs = usize::from(args.num_envs);
    let all = threads();
    let mut entries = vec![
        Entry::new("bare-loop", UNIT, BareLoop::new(episodes)?),
        Entry::new("physics", UNIT, BareLoop::with_forward(episodes)?),
        Entry::new("single", UNIT, Single::new(episodes)?),
        Entry::new("threads-1", UNIT, Together::new(episodes, num_envs, 1)?),
    ];
    if all > 1 {
        let together = Together::new(episodes, num_envs, all)?;
        entries.extend([
            Entry::new(&format!("threads-{all}"), UNIT, together),
            Entry::new("apart-1", UNIT, Apart::new(episodes, num_envs, 1)?),
            Entry::new(&format!("apart-{all}"), UNIT, Apart::new(episodes, num_envs, all)?),
        ]);
    }
    if args.peers {
        let id = EnvId { task: episodes.config.task(), reward: RewardKind::Sparse };
        let name = format!("envpool-{num_envs}-threads-{all}");
        entries.extend([
            Entry::new("gymnasium-robotics", UNIT, peer("gymnasium-robotics", id, 1, 1)?),
            Entry::new("envpool", UNIT, peer("envpool", id, 1, 1)?),
            Entry::new(&name, UNIT, peer("envpool", id, num_envs, all)?),
        ]);
    }
    Ok(entries)
}

/// Starts environments of a peer, which step one episode each in a turn.
fn peer(name: &str, id: EnvId, num_envs: usize, threads: usize) -> anyhow::Result<Orders> {
    const SCRIPT: &str = include_str!("../../../scripts/peers.py");
    let arguments = [name.into(), id.to_string()]
        .into_iter()
        .chain(["--num-envs".into(), num_envs.to_string()])
        .chain(["--threads".into(), threads.to_string()])
        .collect::<Vec<String>>();
    let peer = Peer::start(&python::peers()?, ("peers.py", SCRIPT), &arguments, "disable")?;
    Ok(Orders::new(&peer, (num_envs * STEPS).to_string()))
}

/// Returns the ratios of figures to one another.
fn ratios(steps: &Rounds, resets: &Rounds) -> Vec<(String, Metric)> {
    let (threads, apart) = (format!("threads-{}", threads()), format!("apart-{}", threads()));
    let ratio = |name: &str, rounds: &Rounds, clock, of, to| {
        let value = rounds.ratio(clock, of, to)?;
        Some((format!("ratio/{name}"), Metric::new(value, "1")))
    };
    [
        ratio("single-to-bare-loop", steps, Cpu, "single", "bare-loop"),
        ratio("single-to-physics", steps, Cpu, "single", "physics"),
        ratio(&format!("{threads}-to-threads-1"), steps, Wall, &threads, "threads-1"),
        ratio(&format!("{apart}-to-apart-1"), steps, Wall, &apart, "apart-1"),
        ratio("single-to-gymnasium-robotics", steps, Cpu, "single", "gymnasium-robotics"),
        ratio("single-to-envpool", steps, Wall, "single", "envpool"),
        // A ratio of costs: the slower is the larger.
        ratio("reset-cost-to-bare", resets, Cpu, "reset-bare", "reset"),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn threads() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}
