//! `soak`: steps, resets, saves and renders environments for a long time, and checks that no
//! memory, handles or threads are left behind.

use std::{
    fmt,
    num::NonZeroU64,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, ensure};
use baselines::{Collector, CollectorSnapshot, RandomPolicy, buffer_config};
use fetch_env::{
    Env, EnvId, MujocoEnv, RenderEnv, RenderOptions, Renderer, SnapshotEnv, VecEnv, make,
    vec_env::VecConfig,
};
use fetch_sim::{SimConfig, Task};
use goal_reward::RewardKind;
use her_relabel::HerBuffer;
use serde::Serialize;

use crate::shared::process::Held;
use fetch_cli::shared::{
    check::mark,
    json::{Metric, write_results},
    progress,
};

/// The environments of a round, and the steps that each of them takes.
const ENVS: usize = 8;
const STEPS: usize = 1_000;

/// Parts of a round, after each of which all environments return to a snapshot.
const PARTS: usize = 2;
const PICTURES: usize = 4;

/// The number of rows of the table.
const ROWS: u64 = 20;

/// How much memory may grow in the second half of the steps, once caches are full (bytes).
const MAY_GROW: u64 = 8 << 20;

const MIB: f64 = (1 << 20) as f64;

#[derive(Debug, clap::Args, Serialize)]
pub struct Args {
    /// Steps of all environments together
    #[arg(long, default_value = "200000")]
    steps: NonZeroU64,
    /// Also write the results as JSON
    #[arg(long)]
    #[serde(skip)]
    json: Option<PathBuf>,
}

/// What the process holds after a number of steps.
struct Row {
    steps: u64,
    seconds: f64,
    held: Held,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { steps, seconds, held: Held { memory, handles, threads } } = self;
        let memory = *memory as f64 / MIB;
        write!(f, "| {steps:>10} | {seconds:>7.0} | {memory:>6.1} | {handles:>7} | {threads:>7} |")
    }
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let (start, total) = (Instant::now(), args.steps.get());
    let folder = tempfile::tempdir()?;
    let draws = Renderer::new(&SimConfig::new(Task::Reach), picture()).is_ok();
    let bar = progress::bar(usize::try_from(total)?, "steps");
    say!("|      steps | seconds |    MiB | handles | threads |")?;
    say!("|-----------:|--------:|-------:|--------:|--------:|")?;
    let (mut done, mut rows) = (0, Vec::<Row>::new());
    for (seed, task) in (0..).zip(Task::ALL.into_iter().cycle()) {
        done += one_round(task, seed, &folder.path().join("buffer"), draws)?;
        bar.set_position(done);
        if ROWS * done >= total * (rows.len() as u64 + 1) {
            let seconds = start.elapsed().as_secs_f64();
            let row = Row { steps: done, seconds, held: Held::now()? };
            bar.suspend(|| say!("{row}"))?;
            rows.push(row);
        }
        if done >= total {
            break;
        }
    }
    bar.finish_and_clear();
    report(args, &rows, draws)
}

fn picture() -> RenderOptions {
    RenderOptions::default().with_width(84).with_height(84).with_samples(0)
}

/// Makes the environments of a task, uses them as a user does, and drops them. Returns the number
/// of steps.
fn one_round(task: Task, seed: u64, file: &Path, draws: bool) -> anyhow::Result<u64> {
    type Snapshot = CollectorSnapshot<<MujocoEnv as SnapshotEnv>::Snapshot>;

    let config = EnvId { task, reward: RewardKind::Sparse }.config();
    let make = |_| make(config.clone());
    let envs = (0..ENVS).map(make).collect::<Result<Vec<_>, _>>()?;
    let config = buffer_config(ENVS * STEPS, &envs[0])?.with_num_envs(ENVS);
    let mut buffer = HerBuffer::<f32>::new(config)?;
    let mut policy = RandomPolicy::new(envs[0].action_space(), seed);
    let mut collector = Collector::new(VecEnv::new(envs, VecConfig::default())?);
    collector.reset(Some(seed), &mut buffer)?;
    for _ in 0..PARTS {
        let collected = collector.collect(STEPS / PARTS, &mut policy, &mut buffer, |_, _| ())?;
        ensure!(collected.first_failure.is_none(), "{:?}", collected.first_failure);
        let snapshot = serde_json::to_vec(&collector.snapshot()?)?;
        collector.restore(&serde_json::from_slice::<Snapshot>(&snapshot)?)?;
        buffer.resume(collector.envs().last_step())?.check()?;
    }
    if draws {
        let env = collector.envs().env(0).context("an idle environment")?;
        let mut renderer = env.renderer(picture())?;
        for _ in 0..PICTURES {
            env.render(&mut renderer)?;
        }
    }
    buffer.save(file)?;
    ensure!(HerBuffer::<f32>::load(file)?.len() == buffer.len(), "the buffer has changed");
    Ok((ENVS * STEPS) as u64)
}

/// Prints what the table shows, and returns whether nothing is left behind.
fn report(args: &Args, rows: &[Row], draws: bool) -> anyhow::Result<bool> {
    if !draws {
        say!("nothing was rendered: there is no OpenGL")?;
    }
    let settled = &rows[rows.len() / 2..];
    let first = settled.first().context("a row")?.held;
    let most = settled.iter().map(|row| row.held.memory).max().unwrap_or(first.memory);
    let grown = most - first.memory;
    let checks = [
        (
            grown <= MAY_GROW,
            format!("memory grew by {:.1} MiB in the second half", grown as f64 / MIB),
        ),
        (settled.iter().all(|row| row.held.handles == first.handles), "no handle was left".into()),
        (settled.iter().all(|row| row.held.threads == first.threads), "no thread was left".into()),
    ];
    for (passed, what) in &checks {
        say!("{}  {what}", mark(*passed))?;
    }
    let results = rows.iter().flat_map(|Row { steps, seconds, held }| {
        [
            ("seconds", Metric::new(*seconds, "s")),
            ("memory", Metric::new(held.memory as f64, "B")),
            ("handles", Metric::count(held.handles)),
            ("threads", Metric::count(held.threads)),
        ]
        .map(|(name, figure)| (format!("{steps}/{name}"), figure))
    });
    write_results(args.json.as_ref(), args, results)?;
    Ok(checks.iter().all(|(passed, _)| *passed))
}
