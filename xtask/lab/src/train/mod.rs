//! `train`: trains a policy, with its curve, checkpoints and a page. It fails if the policy does not
//! reach the target.

pub mod curve_line;
pub mod files;
mod options;
mod page;

use std::{
    num::{NonZeroU64, NonZeroUsize},
    ops::ControlFlow,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::Context;
use baselines::{
    Estimate, SuccessRate, TrainedPolicy,
    learn::{CurveRow, Resumed, Target, TrainSettings, Trainer, UpdateSeconds},
    workers::{Workers, evaluate_spread, sum},
};
use fetch_env::{
    EnvError, EnvId, MujocoEnv, Task, make_vec_with_config, make_with_config, vec_env::VecConfig,
};
use indicatif::ProgressBar;

use self::{
    files::{Outcome, Run, RunFiles},
    options::{AlgorithmChoice, Preset},
};
use crate::shared::{
    choice::ModelChoice,
    json::{Metric, write_results},
    progress,
    ranks::{MakeWorkers, RankArgs, of_first, share_run},
};

#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Environment
    #[arg(long, default_value = "FetchReach-v4")]
    env_id: EnvId,
    /// Settings to start from
    #[arg(long, value_enum, default_value_t = Preset::Fast)]
    preset: Preset,
    /// Algorithm, with its default settings if it is not the preset's
    #[arg(long, value_enum)]
    algorithm: Option<AlgorithmChoice>,
    /// Seed of the run
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of runs, with the seeds that follow
    #[arg(long, default_value = "1")]
    seeds: NonZeroU64,
    /// Number of environments stepped together
    #[arg(long)]
    envs: Option<NonZeroUsize>,
    /// Number of threads; results do not depend on it
    #[arg(long, default_value_t = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN))]
    threads: NonZeroUsize,
    /// Environment steps after which the run ends, if it has not reached the target
    #[arg(long)]
    steps: Option<u64>,
    /// Success rate at which the run ends, if two evaluations in a row reach it; 2 for never
    #[arg(long)]
    target: Option<f64>,
    /// Number of scripted episodes in the buffer before the run, at most 10000, or a file of episodes:
    /// an archive of numpy arrays (.npz), or a saved buffer
    #[arg(long, value_parser = options::demos)]
    demos: Option<String>,
    /// Change a setting, such as gamma=0.98; can be given several times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Model of the robot
    #[arg(long, value_enum, default_value_t = ModelChoice::Builtin)]
    model: ModelChoice,
    /// Folder of the run; by default it has the names of environment and seed below results/train
    #[arg(long)]
    out: Option<PathBuf>,
    /// Replace the run that the folder has
    #[arg(long)]
    overwrite: bool,
    /// Continue the run of this folder from its last checkpoint
    #[arg(long, conflicts_with_all = ["env_id", "preset", "algorithm", "seed", "seeds", "envs", "demos", "set", "model", "out", "overwrite"])]
    resume: Option<PathBuf>,
    /// Least number of seconds between two checkpoints
    #[arg(long, default_value_t = 30.0)]
    checkpoint_seconds: f64,
    /// Also write the results as JSON
    #[arg(long)]
    json: Option<PathBuf>,
    #[command(flatten)]
    ranks: RankArgs,
}

/// The seeds of the final evaluation, which no training and no other evaluation has.
const FINAL_SEED: u64 = 1 << 50;
const FINAL_EPISODES: usize = 100;

pub fn run(args: &Args) -> anyhow::Result<bool> {
    // Wrong usage is told before ranks meet.
    let settings = options::settings(args)?;
    share_run(&args.ranks, &options::facts(args), |workers| run_shared(args, &settings, workers))
}

fn run_shared(args: &Args, settings: &TrainSettings, workers: MakeWorkers) -> anyhow::Result<bool> {
    let mut results = Vec::new();
    if let Some(folder) = &args.resume {
        results.push(resume(args, folder, workers())?);
    } else {
        for run in 0..args.seeds.get() {
            results.push(start(args, settings, args.seed.wrapping_add(run), workers())?);
        }
    }
    if workers().rank() == 0 {
        write_results(args.json.as_ref(), &results, figures(&results))?;
    }
    Ok(results.iter().all(|outcome| outcome.reached.is_some() || outcome.target > 1.0))
}

fn resume(args: &Args, folder: &Path, mut workers: Box<dyn Workers>) -> anyhow::Result<Outcome> {
    let (rank, size) = (workers.rank(), workers.size());
    let run: Run = of_first(&mut *workers, || Run::read(folder))?;
    let files = RunFiles { folder: folder.to_owned(), run };
    let (env_id, model) = (files.run.env_id()?, files.run.model);
    let make = || make(env_id, model);
    let (trainer, resumed) =
        Trainer::resume_with_workers(make, folder, args.threads.get(), workers)?;
    if rank == 0 {
        say!("train: resuming {} after {} steps", folder.display(), trainer.counters().steps)?;
        if let Resumed::OnOtherRanks { before } = resumed {
            say!(
                "train: the checkpoint is of {before} ranks, and this run has {size}: networks, \
                 optimizers, normalizers, counters and finished episodes are the same; unfinished \
                 episodes are lost, and all following random numbers are others"
            )?;
        }
    }
    finish(args, trainer, &files)
}

/// Makes an environment of a run.
fn make(env_id: EnvId, model: ModelChoice) -> Result<MujocoEnv, EnvError> {
    make_with_config(env_id.config().with_model(model.source()))
}

fn start(
    args: &Args,
    settings: &TrainSettings,
    seed: u64,
    workers: Box<dyn Workers>,
) -> anyhow::Result<Outcome> {
    let name = format!("{}-seed-{seed}", args.env_id);
    let folder = match &args.out {
        Some(folder) if args.seeds.get() == 1 => folder.clone(),
        Some(folder) => folder.join(format!("seed-{seed}")),
        None => PathBuf::from("results/train").join(name),
    };
    let make = || make(args.env_id, args.model);
    let threads = args.threads.get();
    let mut trainer = Trainer::with_workers(make, settings.clone(), seed, threads, workers)?;
    let is_first = trainer.workers().rank() == 0;
    let files = if is_first {
        RunFiles::create(&folder, args, seed)?
    } else {
        RunFiles { folder: folder.clone(), run: Run::new(args, seed) }
    };
    if let Some(demos) = &args.demos {
        options::add_demos(&mut trainer, args, demos, seed)?;
        if is_first {
            say!("train: {} episodes of demonstrations", trainer.counters().demonstrations)?;
        }
    }
    trainer.save(&folder)?;
    finish(args, trainer, &files)
}

/// Runs a trainer to its end, and writes its files.
fn finish(
    args: &Args,
    mut trainer: Trainer<MujocoEnv>,
    files: &RunFiles,
) -> anyhow::Result<Outcome> {
    let run = &files.run;
    let env_id = run.env_id()?;
    let num_steps = args.steps.unwrap_or(run.steps);
    let target = Target { success_rate: args.target.unwrap_or(run.target), evaluations: 2 };
    let is_first = trainer.workers().rank() == 0;
    let bar = progress::bar(usize::try_from(num_steps)?, "training");
    if is_first {
        bar.set_position(trainer.counters().steps);
        files.write_curve(trainer.rows())?;
    }
    let mut saved = Instant::now();
    let mut outcome = Ok(());
    trainer.run(num_steps, Some(target), |trainer, row| {
        if is_first {
            show(&bar, row);
            outcome = files.write_curve(trainer.rows());
        }
        let is_due = saved.elapsed().as_secs_f64() >= args.checkpoint_seconds;
        let saves = is_first && is_due && outcome.is_ok();
        match sum(trainer.workers(), u64::from(saves)) {
            Ok(0) => {}
            Ok(_) => {
                outcome = trainer.save(&files.folder).map(|_| ()).context("the run stops here");
                saved = Instant::now();
            }
            Err(error) => outcome = Err(error.into()),
        }
        if outcome.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    })?;
    outcome?;
    bar.finish_and_clear();
    trainer.save(&files.folder)?;
    let policy = trainer.policy(&env_id.to_string())?;
    let policy = measured(trainer.workers(), policy, env_id, run.model, args.threads.get())?;
    let reached = trainer.rows().windows(2).position(|rows| target.is_reached(rows));
    let outcome = Outcome {
        env_id: env_id.to_string(),
        seed: trainer.seed(),
        counters: *trainer.counters(),
        target: target.success_rate,
        reached: reached.map(|first| trainer.rows()[first + 1].counters),
        success: policy.header().success,
    };
    if is_first {
        files.write_policy(&policy)?;
        page::write(&files.folder, env_id, run.model, trainer.rows(), trainer.settings(), policy)?;
        say!("train: {outcome}; wrote {}", files.folder.display())?;
        let UpdateSeconds { total, exchanging, .. } = trainer.update_seconds();
        if exchanging > 0.0 {
            say!("train: of {total:.1} s of updates, {exchanging:.1} s were spent in MPI")?;
        }
    }
    Ok(outcome)
}

/// Measures the success rate of a policy on seeds that no training has seen.
fn measured(
    workers: &mut dyn Workers,
    mut policy: TrainedPolicy,
    env_id: EnvId,
    model: ModelChoice,
    threads: usize,
) -> anyhow::Result<TrainedPolicy> {
    let config = env_id.config().with_model(model.source());
    let vec_config = VecConfig::default().with_num_threads(threads);
    let mut envs = make_vec_with_config(&config, 20, vec_config)?;
    let count = FINAL_EPISODES;
    let evaluation = evaluate_spread(workers, &mut envs, &mut policy, count, FINAL_SEED, |_| ())?;
    let rate = evaluation.summary()?.success_rate;
    let success = SuccessRate { rate, episodes: FINAL_EPISODES, first_seed: FINAL_SEED };
    Ok(policy.with_success(success))
}

fn show(bar: &ProgressBar, row: &CurveRow) {
    let CurveRow { counters, success_rate: Estimate { value, .. }, .. } = row;
    bar.set_position(counters.steps);
    bar.set_message(format!("success {value:.2}"));
    progress::note(
        bar,
        format_args!(
            "{:>9} steps {:>7} updates {:>8.2} s  success {value:.2}",
            counters.steps, counters.updates, counters.seconds
        ),
    );
}

fn figures(outcomes: &[Outcome]) -> Vec<(String, Metric)> {
    let mut figures = Vec::new();
    for outcome in outcomes {
        let mut push = |name: &str, figure| {
            let Outcome { env_id, seed, .. } = outcome;
            figures.push((format!("train/{env_id}/seed-{seed}/{name}"), figure));
        };
        if let Some(reached) = outcome.reached {
            push("steps_to_target", Metric::new(reached.steps as f64, "1"));
            push("seconds_to_target", Metric::new(reached.seconds, "s"));
        }
        push("steps", Metric::new(outcome.counters.steps as f64, "1"));
        push("seconds", Metric::new(outcome.counters.seconds, "s"));
        if let Some(success) = outcome.success {
            push("success_rate", Metric::new(success.rate.value, "1"));
        }
    }
    figures
}

/// The steps after which a run ends by default, and the success rate at which it does.
pub const fn limits(task: Task) -> (u64, f64) {
    match task {
        Task::Reach => (10_000, 1.0),
        Task::Push => (500_000, 0.9),
        Task::PickAndPlace => (1_500_000, 0.9),
        Task::Slide => (4_000_000, 0.7),
    }
}

/// Returns the settings that a preset has for a task.
fn preset(preset: Preset, env_id: EnvId) -> TrainSettings {
    match preset {
        Preset::Authors => TrainSettings::authors(),
        Preset::Fast => TrainSettings::fast(env_id.task),
    }
}
