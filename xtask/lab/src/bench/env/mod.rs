//! `bench env`: measures steps, resets, and the construction and memory of environments.

pub(super) mod contenders;
pub(super) mod episodes;
pub(super) mod recording;

use std::{
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use anyhow::Context;
use fetch_env::{EnvId, FetchConfig, ModelSource, make_vec, vec_env::VecConfig};
use goal_reward::RewardKind;
use serde::Serialize;

use self::{
    contenders::{BareLoop, Repeated, Single, apart, bare_resets, resets, together},
    episodes::{Episodes, SEED, STEPS, random_actions},
};
use super::{
    Subject, Subjects,
    interleaved::{
        Clock::{Cpu, Wall},
        Contender, Entry, Rounds, interleave,
    },
    measure_in_new_process,
    peer::{Orders, Peer, note_other_mujoco},
    report,
};
use crate::shared::{
    process::Held,
    python::{self, Peers},
};
use fetch_cli::shared::json::Metric;

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
    /// Also measure gymnasium-robotics, EnvPool and the Python package, in a Python environment in
    /// the cache
    #[arg(long)]
    peers: bool,
    /// Number of environments whose construction and memory are measured
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u16).range(2..))]
    footprint_envs: u16,
    /// Measure construction and memory in this process, and print them
    #[arg(long, hide = true, requires_all = ["task", "model"])]
    #[serde(skip)]
    footprint: bool,
    /// Let mass, size and friction vary there
    #[arg(long, hide = true, requires = "footprint")]
    #[serde(skip)]
    varied: bool,
}

impl Args {
    /// Makes the Python environment of the peers, if `--peers` is given, and prints what they are.
    pub fn start_peers(&self) -> anyhow::Result<Option<Peers>> {
        if !self.peers {
            return Ok(None);
        }
        note_other_mujoco()?;
        let peers = Peers::new()?;
        say!("the peers are {} and EnvPool {}", python::REFERENCE[0], peers.envpool)?;
        Ok(Some(peers))
    }
}

/// The settings, and the version of EnvPool if it was measured.
#[derive(Serialize)]
pub struct Settings<'a> {
    #[serde(flatten)]
    args: &'a Args,
    #[serde(skip_serializing_if = "Option::is_none")]
    envpool: Option<&'a str>,
}

impl<'a> Settings<'a> {
    pub fn new(args: &'a Args, peers: Option<&'a Peers>) -> Self {
        Self { args, envpool: peers.map(|peers| peers.envpool.as_str()) }
    }
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|error| format!("{error}"))?;
    let sensible = (0.0..=86_400.0).contains(&seconds);
    sensible.then_some(seconds).ok_or_else(|| "choose from 0 to 86400 seconds".into())
}

pub fn run(args: &Args, peers: Option<&Peers>) -> anyhow::Result<Vec<(String, Metric)>> {
    let subjects = args.subjects.all();
    if args.footprint {
        let subject = subjects[0];
        let config = if args.varied { subject.varied(false)? } else { subject.config() };
        let measured = footprint(&config, args.footprint_envs.into())?;
        say!("{}", serde_json::to_string(&measured)?)?;
        return Ok(Vec::new());
    }
    let mut figures = Vec::new();
    for subject in subjects {
        report(&mut figures, &format!("env/{subject}"), measure(args, subject, peers)?)?;
    }
    Ok(figures)
}

fn measure(
    args: &Args,
    subject: Subject,
    peers: Option<&Peers>,
) -> anyhow::Result<Vec<(String, Metric)>> {
    let episodes = Episodes::new(subject.config())?;
    let steps =
        interleave(steppers(args, &episodes, peers)?, Duration::from_secs_f64(args.seconds))?;
    let entries = vec![
        Entry::new("reset", "resets/s", resets(&episodes)?),
        Entry::new("reset-bare", "resets/s", bare_resets(&episodes)?),
    ];
    let resets = interleave(entries, Duration::from_secs_f64(args.seconds / 10.0))?;
    let mut figures: Vec<_> = steps.figures().chain(resets.figures()).collect();
    figures.extend(ratios(&steps, &resets));
    let envs = args.footprint_envs;
    let footprint = format!("bench env --footprint --footprint-envs {envs} {}", subject.flags());
    for (varied, name) in [(None, ""), (Some("--varied"), "-varied")] {
        let text = measure_in_new_process(footprint.split(' ').chain(varied))?;
        let [construction, further_env]: [f64; 2] =
            serde_json::from_str(&text).with_context(|| format!("no measurement: {text}"))?;
        figures.push((format!("construction{name}-{envs}"), Metric::new(construction, "s")));
        figures.push((format!("memory-further{name}-env"), Metric::new(further_env, "bytes")));
    }
    Ok(figures)
}

/// Returns the seconds until many environments are made and reset, including the model's
/// compilation, and the resident bytes of each environment beyond the first.
fn footprint(config: &FetchConfig, envs: usize) -> anyhow::Result<[f64; 2]> {
    // Enough steps for every environment to touch all of its memory.
    const STEPS: usize = 10;
    let actions = random_actions(envs).into_flattened();
    let start = Instant::now();
    let mut first = make_vec(config.clone(), 1, VecConfig::default())?;
    first.reset(Some(SEED))?;
    let first_made = start.elapsed();
    for _ in 0..STEPS {
        first.step(&actions[..4])?;
    }
    let one = Held::now()?.memory as f64;
    let start = Instant::now();
    let mut others = make_vec(config.clone(), envs - 1, VecConfig::default())?;
    others.reset(Some(SEED))?;
    let construction = first_made + start.elapsed();
    for _ in 0..STEPS {
        others.step(&actions[4..])?;
    }
    let further_env = (Held::now()?.memory as f64 - one) / (envs - 1) as f64;
    Ok([construction.as_secs_f64(), further_env])
}

fn steppers(
    args: &Args,
    episodes: &Arc<Episodes>,
    peers: Option<&Peers>,
) -> anyhow::Result<Vec<Entry>> {
    let num_envs = usize::from(args.num_envs);
    let all = threads();
    let mut entries = vec![
        entry("bare-loop", BareLoop::new(episodes)?, 1),
        entry("physics", BareLoop::with_forward(episodes)?, 1),
        entry("single", Single::new(episodes)?, 1),
        entry("threads-1", together(episodes, num_envs, 1)?, num_envs),
    ];
    if all > 1 {
        entries.extend([
            entry(&format!("threads-{all}"), together(episodes, num_envs, all)?, num_envs),
            entry("apart-1", apart(episodes, num_envs, 1)?, num_envs),
            entry(&format!("apart-{all}"), apart(episodes, num_envs, all)?, num_envs),
        ]);
    }
    if let Some(peers) = peers {
        let id = EnvId { task: episodes.config.task(), reward: RewardKind::Sparse };
        let model = match episodes.config.sim().model() {
            ModelSource::Reference => "reference",
            _ => "builtin",
        };
        let peer = |name, num_envs, threads| peer(peers, name, id, (num_envs, threads), model);
        let many = |name, threads| peer(name, num_envs, threads);
        let name = format!("envpool-{num_envs}-threads-{all}");
        entries.extend([
            Entry::new("gymnasium-robotics", UNIT, peer("gymnasium-robotics", 1, 1)?),
            Entry::new("envpool", UNIT, peer("envpool", 1, 1)?),
            Entry::new(&name, UNIT, many("envpool", all)?),
            Entry::new("python", UNIT, peer("fetch-env", 1, 1)?),
            Entry::new("python-threads-1", UNIT, many("fetch-env-vector", 1)?),
            Entry::new(&format!("python-threads-{all}"), UNIT, many("fetch-env-vector", all)?),
        ]);
    }
    Ok(entries)
}

/// The unit of all speeds.
const UNIT: &str = "steps/s";
/// The least number of episodes in a turn.
const LEAST_EPISODES: usize = 5;

/// Returns a contender that steps `num_envs` environments for one episode each, and does so as
/// often as [`episodes_each`] says in a turn.
fn entry(name: &str, contender: impl Contender + 'static, num_envs: usize) -> Entry {
    Entry::new(name, UNIT, Repeated { contender, times: episodes_each(num_envs) })
}

/// Returns the number of episodes that each of `num_envs` environments plays in a turn. Short turns
/// would measure how long it takes until the caches hold a contender's code and data.
fn episodes_each(num_envs: usize) -> usize {
    LEAST_EPISODES.div_ceil(num_envs)
}

/// Starts environments of a peer.
fn peer(
    peers: &Peers,
    name: &str,
    id: EnvId,
    (num_envs, threads): (usize, usize),
    model: &str,
) -> anyhow::Result<Orders> {
    const SCRIPT: &str = include_str!("../../../scripts/peers.py");
    let arguments =
        format!("{name} {id} --num-envs {num_envs} --threads {threads} --model {model}");
    let arguments: Vec<_> = arguments.split(' ').map(str::to_owned).collect();
    let peer = Peer::start(&peers.python, ("peers.py", SCRIPT), &arguments, "disable")?;
    Ok(Orders::new(&peer, (episodes_each(num_envs) * num_envs * STEPS).to_string()))
}

/// Returns the ratios of figures to one another.
fn ratios(steps: &Rounds, resets: &Rounds) -> impl Iterator<Item = (String, Metric)> {
    let (threads, apart) = (format!("threads-{}", threads()), format!("apart-{}", threads()));
    let of_python = format!("python-{threads}");
    let ratio = |name: &str, rounds: &Rounds, clock, of, to| {
        rounds.ratio(&format!("ratio/{name}"), clock, of, to)
    };
    [
        ratio("single-to-bare-loop", steps, Cpu, "single", "bare-loop"),
        ratio("single-to-physics", steps, Cpu, "single", "physics"),
        ratio(&format!("{threads}-to-threads-1"), steps, Wall, &threads, "threads-1"),
        ratio(&format!("{apart}-to-apart-1"), steps, Wall, &apart, "apart-1"),
        ratio("single-to-gymnasium-robotics", steps, Cpu, "single", "gymnasium-robotics"),
        ratio("single-to-envpool", steps, Wall, "single", "envpool"),
        ratio("python-to-single", steps, Cpu, "python", "single"),
        ratio("python-threads-1-to-threads-1", steps, Cpu, "python-threads-1", "threads-1"),
        ratio(&format!("python-{threads}-to-{threads}"), steps, Wall, &of_python, &threads),
        ratio("python-to-gymnasium-robotics", steps, Cpu, "python", "gymnasium-robotics"),
        ratio("python-to-envpool", steps, Wall, "python", "envpool"),
        // A ratio of costs, which is larger where the environment is slower.
        ratio("reset-cost-to-bare", resets, Cpu, "reset-bare", "reset"),
    ]
    .into_iter()
    .flatten()
}

fn threads() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}
