//! `plan`: plans episodes on exact snapshots, and shows what the scripted and the trained policy do
//! from the same starts. Ctrl-C and SIGTERM end it after the current start, a second signal at
//! once.

mod start;
mod table;

use std::{num::NonZeroUsize, path::PathBuf, thread::available_parallelism, time::Instant};

use anyhow::ensure;
use baselines::{
    Episode, OnMujoco, Plan, PlannedPolicy, Planner, PlannerSettings, ScriptedPolicy,
    TrainedPolicy, evaluate,
};
use fetch_env::EnvId;
use serde::Serialize;

use self::start::Start;
use crate::shared::{
    choice::ModelChoice,
    json::write_results,
    progress,
    signals::{Signals, Stopped},
    tasks::Tasks,
};

#[derive(Clone, Debug, clap::Args, Serialize)]
pub struct Args {
    /// Environment
    #[arg(long, default_value = "FetchSlide-v4")]
    env_id: EnvId,
    /// Number of starts
    #[arg(long, default_value = "25")]
    starts: NonZeroUsize,
    /// Seed of the first start; the others have the seeds that follow
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Start from the better of the two policies' episodes, and continue after the first success to
    /// find one in fewer steps
    #[arg(long)]
    fewest_steps: bool,
    /// Number of threads; results do not depend on it
    #[arg(long)]
    #[arg(default_value_t = available_parallelism().unwrap_or(NonZeroUsize::MIN))]
    #[serde(skip)]
    threads: NonZeroUsize,
    /// Model of the robot
    #[arg(long, value_enum, default_value_t = ModelChoice::Builtin)]
    model: ModelChoice,
    /// Also write the results, and those of each start, as JSON
    #[arg(long)]
    #[serde(skip)]
    json: Option<PathBuf>,
}

/// The players of the episodes.
struct Players {
    planner: Planner,
    scripted: ScriptedPolicy,
    trained: TrainedPolicy,
}

pub fn run(tasks: &impl Tasks, args: &Args) -> anyhow::Result<bool> {
    let task = args.env_id.task;
    let fewest_steps = args.fewest_steps;
    let settings = PlannerSettings { fewest_steps, ..PlannerSettings::default() };
    let mut players = Players {
        planner: Planner::new(settings.clone())?,
        scripted: ScriptedPolicy::new(task),
        trained: TrainedPolicy::shipped(task)?,
    };
    let config = args.env_id.config().with_model(args.model.source());
    // An environment simulates at least one candidate.
    let num_envs = args.threads.get().min(settings.population);
    let envs = (0..num_envs).map(|_| tasks.make(config.clone()));
    let mut envs = envs.collect::<Result<Vec<_>, _>>()?;
    let signals = Signals::listen()?;
    let put_off = signals.put_off();
    let bar = progress::bar(args.starts.get(), "starts");
    let mut starts: Vec<Start> = Vec::new();
    for number in 0..args.starts.get() as u64 {
        if signals.received() != 0 {
            break;
        }
        let start = players.play(args, &mut envs, args.seed.wrapping_add(number))?;
        progress::note(&bar, format_args!("plan: {start}"));
        starts.push(start);
        bar.inc(1);
    }
    bar.finish_and_clear();
    drop(put_off);
    let rows = table::rows(task, &starts);
    let title = format!("plan/{}", args.env_id);
    let figures = rows.iter().flat_map(|row| row.figures(&title));
    let figures = figures.chain(starts.iter().flat_map(|start| start.figures(&title)));
    write_results(args.json.as_ref(), args, figures)?;
    // Ctrl-C may also have ended the program that reads the table.
    let printed = print(&rows);
    match Stopped::by(signals.received()) {
        Some(stopped) => {
            crate::output::tell(format_args!("plan: {stopped} after {} starts", starts.len()));
            Err(stopped.into())
        }
        None => printed.map(|()| true),
    }
}

fn print(rows: &[table::Row]) -> anyhow::Result<()> {
    say!("{}", table::HEAD)?;
    rows.iter().try_for_each(|row| say!("{}", row.line()))
}

impl Players {
    /// Plays the episode of a seed in three ways. The plan is then played from the reset again, and
    /// must end the same way.
    fn play(
        &mut self,
        args: &Args,
        envs: &mut [impl OnMujoco + Send],
        seed: u64,
    ) -> anyhow::Result<Start> {
        let env = &mut envs[0];
        let first = env.reset(Some(seed))?.observation;
        let start = env.snapshot();
        let scripted = Plan::record(env, &first, &mut self.scripted)?;
        env.restore(&start)?;
        let trained = Plan::record(env, &first, &mut self.trained)?;
        env.restore(&start)?;
        let begun = Instant::now();
        let planned = if args.fewest_steps {
            let steps = |plan: &&Plan| plan.steps_to_goal.unwrap_or(usize::MAX);
            let better = std::cmp::min_by_key(&scripted, &trained, steps);
            let mut better = PlannedPolicy::new(better.actions.clone());
            self.planner.plan(envs, &first, &mut better)?
        } else {
            self.planner.plan_task(envs, &first, args.env_id.task)?
        };
        let seconds = begun.elapsed();
        let mut replay = PlannedPolicy::new(planned.actions.clone());
        let replayed = evaluate(&mut envs[0], &mut replay, 1, seed, |_| ())?.episodes;
        ensure!(
            replayed == [Episode { seed: Some(seed), ..planned.episode.clone() }],
            "the plan of seed {seed} ends differently when it is played: {replayed:?}, not {:?}",
            planned.episode
        );
        Ok(Start::new(seed, &first, seconds, [planned, scripted, trained]))
    }
}
