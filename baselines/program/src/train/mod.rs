//! `train`: trains a policy, with its curve, checkpoints and a page. It fails if the policy does
//! not reach the target. Ctrl-C and SIGTERM end it with a last checkpoint, a second signal at once.

pub mod curve_line;
pub mod files;
mod finish;
mod grid;
mod lock;
mod options;
mod page;

use std::{
    num::{NonZeroU64, NonZeroUsize},
    path::{Path, PathBuf},
};

use crate::output::tell;
use baselines::{
    Estimate,
    learn::{CurveRow, Preset, Resumed, Target, TrainError, TrainSettings, Trainer, UpdateSeconds},
    workers::Workers,
};
use fetch_env::{EnvError, EnvId, MujocoEnv};
use indicatif::ProgressBar;

use self::{
    files::{Outcome, Run, RunFiles},
    finish::{Course, Length, first_signal},
    options::AlgorithmChoice,
};
use crate::output::usage;
use crate::shared::{
    choice::ModelChoice,
    json::{Metric, write_results},
    mujoco::advice,
    progress,
    ranks::{MakeWorkers, RankArgs, of_first, share_run},
    signals::{Signals, Stopped},
};

#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Environment
    #[arg(long, default_value = "FetchReach-v4")]
    env_id: EnvId,
    /// Settings to start from: fast (learn soonest on a few cores), book (fast with SAC, and the
    /// discount and temperature of the chapter's book) or authors (those of openai/baselines, in one
    /// process)
    #[arg(long, default_value_t = Preset::Fast)]
    preset: Preset,
    /// Algorithm, with its default settings if it is not the preset's
    #[arg(long, value_enum)]
    algorithm: Option<AlgorithmChoice>,
    /// Seed of the run
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of runs, with consecutive seeds from --seed
    #[arg(long, default_value = "1")]
    seeds: NonZeroU64,
    /// Number of environments stepped together
    #[arg(long)]
    envs: Option<NonZeroUsize>,
    /// Number of threads, or of a grid's runs at a time; results do not depend on it
    #[arg(long)]
    #[arg(default_value_t = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN))]
    threads: NonZeroUsize,
    /// Environment steps after which the run ends, if it has not reached the target
    #[arg(long)]
    steps: Option<u64>,
    /// Learn offline, from the episodes of --demos alone, with this number of updates and no
    /// environment steps
    #[arg(long, requires = "demos", conflicts_with = "steps")]
    updates: Option<NonZeroU64>,
    /// Success rate at which the run ends, if two evaluations in a row reach it; 2 for never
    #[arg(long, value_parser = options::target)]
    target: Option<f64>,
    /// Number of scripted episodes in the buffer before the run, at most 10000, or a file of
    /// episodes: an archive of numpy arrays (.npz), from `collect` or in OGBench's format, or a
    /// saved buffer
    #[arg(long, value_parser = options::demos)]
    demos: Option<String>,
    /// Change a setting, such as gamma=0.98; can be given several times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Model of the robot
    #[arg(long, value_enum, default_value_t = ModelChoice::Builtin)]
    model: ModelChoice,
    /// Folder of the run; by default a folder below results/train, named after the environment and
    /// the seed, or after the grid's file
    #[arg(long)]
    out: Option<PathBuf>,
    /// Replace the run in the folder: the files that it wrote, and no others
    #[arg(long)]
    overwrite: bool,
    /// Continue the run of this folder from its last checkpoint
    #[arg(long, conflicts_with_all = ["env_id", "preset", "algorithm", "seed", "seeds", "envs"])]
    #[arg(conflicts_with_all = ["demos", "updates", "set", "model", "out", "overwrite"])]
    resume: Option<PathBuf>,
    /// Run every setting of a grid with every seed, one run per thread; the same command continues
    /// where it stopped. The file is JSON: env_id, preset, steps and target as in the flags, seeds
    /// (a list), and set (an object with a list of values for each key of --set)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["env_id", "preset", "algorithm", "seed"])]
    #[arg(conflicts_with_all = ["seeds", "envs", "steps", "target", "demos", "set", "model"])]
    #[arg(conflicts_with_all = ["overwrite", "resume", "mpi"])]
    grid: Option<PathBuf>,
    /// Minimum number of seconds between two checkpoints
    #[arg(long, default_value_t = 30.0, value_parser = options::checkpoint_seconds)]
    checkpoint_seconds: f64,
    /// Also write the results as JSON
    #[arg(long)]
    json: Option<PathBuf>,
    #[command(flatten)]
    ranks: RankArgs,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    if let Some(file) = &args.grid {
        say_advice()?;
        return grid::run(args, file);
    }
    // Reports wrong usage before the ranks meet.
    let settings = options::settings(args)?;
    let signals = Signals::listen()?;
    share_run(&args.ranks, &options::facts(args), |workers| {
        run_shared(args, &settings, &signals, workers)
    })
}

/// Says how to train faster, if the MuJoCo in use is a slow one.
fn say_advice() -> anyhow::Result<()> {
    advice()?.map_or(Ok(()), |advice| say!("train: {advice}"))
}

fn run_shared(
    args: &Args,
    settings: &TrainSettings,
    signals: &Signals,
    workers: MakeWorkers,
) -> anyhow::Result<bool> {
    if workers().rank() == 0 {
        say_advice()?;
    }
    let mut results = Vec::new();
    if let Some(folder) = &args.resume {
        let (trainer, files) = resume(args, folder, workers())?;
        results.push(finish(args, trainer, &files, signals)?);
    } else {
        for run in 0..args.seeds.get() {
            let seed = args.seed.wrapping_add(run);
            let started = start(args, settings, seed, workers());
            let (trainer, files) = started.map_err(|error| match error.downcast_ref() {
                // One that not every environment can have.
                Some(TrainError::Setting { .. }) => usage(error),
                _ => error,
            })?;
            results.push(finish(args, trainer, &files, signals)?);
        }
    }
    if workers().rank() == 0 {
        write_results(args.json.as_ref(), &results, figures(&results))?;
    }
    Ok(results.iter().all(|outcome| outcome.reached.is_some() || outcome.target > 1.0))
}

/// A run that is ready to continue.
type Ready = (Trainer<MujocoEnv>, RunFiles);

fn resume(args: &Args, folder: &Path, mut workers: Box<dyn Workers>) -> anyhow::Result<Ready> {
    let (rank, size) = (workers.rank(), workers.size());
    let mut own = None;
    let run: Run =
        of_first(&mut *workers, || Ok(own.insert(RunFiles::resume(folder)?).run.clone()))?;
    let files = own.unwrap_or_else(|| RunFiles::of_rank(folder, run));
    let (env_id, model) = (files.run.env_id()?, files.run.model);
    let make = || make(env_id, model);
    let (trainer, resumed) =
        Trainer::resume_with_workers(make, folder, args.threads.get(), workers)?;
    if rank == 0 {
        say!("train: resuming {} after {} steps", folder.display(), trainer.counters().steps)?;
        if let Resumed::OnOtherRanks { before } = resumed {
            say!(
                "train: the checkpoint is from {before} ranks, and this run has {size}: networks, \
                 optimizers, normalizers and counters are the same; each rank keeps the newest \
                 finished episodes that fit into its buffer; unfinished episodes are lost, and \
                 all later random numbers differ"
            )?;
        }
    }
    Ok((trainer, files))
}

/// Makes an environment of a run.
fn make(env_id: EnvId, model: ModelChoice) -> Result<MujocoEnv, EnvError> {
    Ok(fetch_env::make(env_id.config().with_model(model.source()))?)
}

/// Begins a run, once everything else is ready.
fn start(
    args: &Args,
    settings: &TrainSettings,
    seed: u64,
    workers: Box<dyn Workers>,
) -> anyhow::Result<Ready> {
    let name = format!("{}-seed-{seed}", args.env_id);
    let folder = match &args.out {
        Some(folder) if args.seeds.get() == 1 => folder.clone(),
        Some(folder) => folder.join(format!("seed-{seed}")),
        None => PathBuf::from("results/train").join(name),
    };
    let make = || make(args.env_id, args.model);
    let (is_first, threads) = (workers.rank() == 0, args.threads.get());
    let mut trainer = Trainer::with_workers(make, settings.clone(), seed, threads, workers)?;
    if is_first {
        RunFiles::check_free(&folder, args.overwrite)?;
    }
    if let Some(demos) = &args.demos {
        options::add_demos(&mut trainer, args, demos, seed)?;
        if is_first {
            say!("train: {} episodes of demonstrations", trainer.counters().demonstrations)?;
        }
    }
    let files = if is_first {
        RunFiles::create(&folder, args, seed)?
    } else {
        RunFiles::of_rank(&folder, Run::new(args, seed))
    };
    trainer.save(&folder)?;
    Ok((trainer, files))
}

/// Runs a trainer to its end, and writes its files. A signal ends it after a last checkpoint.
fn finish(
    args: &Args,
    mut trainer: Trainer<MujocoEnv>,
    files: &RunFiles,
    signals: &Signals,
) -> anyhow::Result<Outcome> {
    let run = &files.run;
    let length = match run.updates {
        Some(updates) => Length::Updates(updates.get()),
        None => Length::Steps(args.steps.unwrap_or(run.steps)),
    };
    let course = Course {
        length,
        target: Target { success_rate: args.target.unwrap_or(run.target), evaluations: 2 },
        threads: args.threads.get(),
        checkpoint_seconds: args.checkpoint_seconds,
    };
    let is_first = trainer.workers().rank() == 0;
    let bar = progress::bar(usize::try_from(length.end())?, "training");
    if is_first {
        bar.set_position(length.reached(trainer.counters()));
    }
    signals.put_off();
    let watch = |row: &CurveRow| show(&bar, length, row);
    let trained = finish::train(&mut trainer, files, &course, signals, watch);
    signals.end_at_once();
    bar.finish_and_clear();
    trained?;
    if let Some(stopped) = Stopped::by(first_signal(signals, trainer.workers())?) {
        if is_first {
            let folder = files.folder.display().to_string();
            tell(format_args!(
                "train: {stopped} after {} steps: continue it with --resume {}",
                trainer.counters().steps,
                shlex::try_quote(&folder)?
            ));
        }
        return Err(stopped.into());
    }
    let outcome = finish::finish(&mut trainer, files, &course)?;
    if is_first {
        say!("train: {outcome}; wrote {}", files.folder.display())?;
        let UpdateSeconds { total, exchanging, .. } = trainer.update_seconds();
        if exchanging > 0.0 {
            say!("train: of {total:.1} s of updates, {exchanging:.1} s were spent in MPI")?;
        }
    }
    Ok(outcome)
}

fn show(bar: &ProgressBar, length: Length, row: &CurveRow) {
    let CurveRow { counters, success_rate: Estimate { value, .. }, .. } = row;
    bar.set_position(length.reached(counters));
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
        push("episode_return_mean", Metric::new(outcome.episode_return_mean, "1"));
    }
    figures
}
