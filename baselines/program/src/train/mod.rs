//! `train`: trains a policy, with its curve, checkpoints and a page. It fails if the policy does
//! not reach the target. Ctrl-C and SIGTERM end it with a last checkpoint, a second signal at once.

mod errors;
mod finish;
mod grid;
mod options;
mod student;

use std::{
    num::{NonZeroU64, NonZeroUsize},
    path::{Path, PathBuf},
    time::Duration,
};

use baselines::{
    TrainedPolicy,
    learn::{Learner, Preset, Resumed, TrainSettings, Trainer, limits},
    runs::{NewRun, Ready, RunDescription},
    workers::Workers,
};
use fetch_env::EnvId;

use self::{
    errors::in_flags,
    finish::{figures, finish, finish_trained},
    options::{AlgorithmChoice, Noise},
    student::StudentArgs,
};
use crate::shared::{
    choice::ModelChoice,
    json::write_results,
    mujoco::advice,
    ranks::{MakeWorkers, RankArgs, share_run},
    signals::Signals,
    tasks::Tasks,
};

#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Environment
    #[arg(long, default_value = "FetchReach-v4")]
    env_id: EnvId,
    /// Settings to start from: fast (learn soonest on a few cores), book (fast with SAC, and the
    /// discount and temperature of the chapter's book) or authors (those of openai/baselines, in one
    /// process); for dense rewards fast-ppo (PPO, learn soonest) or book-ppo (PPO with the book's
    /// numbers)
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
    #[command(flatten)]
    student: StudentArgs,
    /// Policy to start from: its actor, and the normalizers of its inputs, which then stay as they are
    #[arg(long, value_name = "FILE")]
    start: Option<PathBuf>,
    /// Change a setting of the learner, such as gamma=0.98, or of the distiller with --teacher, such as
    /// hidden=[64,64]; can be given several times. Those of an actor that sees pictures have names such
    /// as pixel_hidden
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Randomize a factor of the environment at each reset, such as object_mass=0.5..4,
    /// friction=log:0.5..2, action_delay=0,1 or observation_noise=0.02; can be given several times
    #[arg(long, value_name = "NAME=DRAW")]
    vary: Vec<String>,
    /// Learn to stand noise of this standard deviation: observation=0.03 on what the actor sees, in
    /// the units of the observation (--set actor_observation_noise), or action=0.05 (--vary
    /// action_noise); can be given several times
    #[arg(long, value_name = "NAME=NUMBER", value_parser = options::noise)]
    noise: Vec<Noise>,
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
    #[arg(conflicts_with_all = ["demos", "start", "updates", "set", "vary", "noise", "model", "out"])]
    #[arg(conflicts_with = "overwrite")]
    resume: Option<PathBuf>,
    /// Run every setting of a grid with every seed, one run per thread; the same command continues
    /// where it stopped. The file is JSON: env_id, preset, steps and target as in the flags, seeds
    /// (a list), set (an object with a list of values for each key of --set), and one_at_a_time (true
    /// for the first values and each change of one of them, not for all combinations)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["env_id", "preset", "algorithm", "seed"])]
    #[arg(conflicts_with_all = ["seeds", "envs", "steps", "target", "demos", "set", "vary", "noise"])]
    #[arg(conflicts_with_all = ["model", "start", "tensorboard", "overwrite", "resume", "mpi"])]
    grid: Option<PathBuf>,
    /// Minimum number of seconds between two checkpoints
    #[arg(long, default_value = "30", value_parser = options::seconds)]
    checkpoint_seconds: Duration,
    /// Folder where TensorBoard finds the curves, each run's in a folder of its seed
    #[arg(long, value_name = "FOLDER")]
    tensorboard: Option<PathBuf>,
    /// Also write the results as JSON
    #[arg(long)]
    json: Option<PathBuf>,
    #[command(flatten)]
    ranks: RankArgs,
}

pub fn run<M: Tasks>(tasks: &M, args: &Args) -> anyhow::Result<bool> {
    if let Some(file) = &args.grid {
        say_advice()?;
        return grid::run(tasks, args, file);
    }
    let args = &options::with_noise(args);
    // Reports wrong usage before the ranks meet.
    let settings = match args.student.teacher {
        None => options::settings(args)?,
        Some(_) => student::taught_settings(args).map(|_| TrainSettings::default())?,
    };
    options::varied(tasks, args)?;
    let signals = Signals::listen()?;
    share_run(&args.ranks, &options::facts(args), |workers| {
        run_shared(tasks, args, &settings, &signals, workers)
    })
}

/// Says how to train faster, if the MuJoCo in use is a slow one.
fn say_advice() -> anyhow::Result<()> {
    advice()?.map_or(Ok(()), |advice| say!("train: {advice}"))
}

fn run_shared<M: Tasks>(
    tasks: &M,
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
        results.push(match student::resume(tasks, args, folder)? {
            Some(mut ready) => {
                say_resumed(&*ready.trainer, folder)?;
                finish(tasks, args, &mut *ready.trainer, &ready.folder, signals)?
            }
            None => {
                let ready = resume(tasks, args, folder, workers())?;
                finish_trained(tasks, args, ready, signals)?
            }
        });
    } else {
        for run in 0..args.seeds.get() {
            let seed = args.seed.wrapping_add(run);
            results.push(if args.student.is_asked() {
                let mut ready = student::start(tasks, args, settings, seed)?;
                finish(tasks, args, &mut *ready.trainer, &ready.folder, signals)?
            } else {
                let ready = start(tasks, args, settings, seed, workers()).map_err(in_flags)?;
                finish_trained(tasks, args, ready, signals)?
            });
        }
    }
    if workers().rank() == 0 {
        write_results(args.json.as_ref(), &results, figures(&results))?;
    }
    Ok(results.iter().all(|outcome| outcome.reached.is_some() || outcome.target > 1.0))
}

fn resume<M: Tasks>(
    tasks: &M,
    args: &Args,
    folder: &Path,
    workers: Box<dyn Workers>,
) -> anyhow::Result<Ready<Trainer<M::Env>>> {
    let (rank, size) = (workers.rank(), workers.size());
    let resumed = Ready::resume_with_workers(tasks, folder, args.threads.get(), workers);
    let (ready, resumed) = resumed.map_err(|error| in_flags(error.into()))?;
    if rank == 0 {
        say_resumed(&ready.trainer, folder)?;
        if let Resumed::OnOtherRanks { before } = resumed {
            say!(
                "train: the checkpoint is from {before} ranks, and this run has {size}: networks, \
                 optimizers, normalizers and counters are the same; each rank keeps the newest \
                 finished episodes that fit into its buffer; unfinished episodes are lost, and \
                 all later random numbers differ"
            )?;
        }
    }
    Ok(ready)
}

fn say_resumed(trainer: &dyn Learner, folder: &Path) -> anyhow::Result<()> {
    let steps = trainer.counters().steps;
    say!("train: resuming {} after {steps} steps", folder.display())
}

/// Returns the folder of a new run.
fn path_of(args: &Args, seed: u64) -> PathBuf {
    let name = format!("{}-seed-{seed}", args.env_id);
    match &args.out {
        Some(folder) if args.seeds.get() == 1 => folder.clone(),
        Some(folder) => folder.join(format!("seed-{seed}")),
        None => PathBuf::from("results/train").join(name),
    }
}

/// Begins a run, once everything else is ready.
fn start<M: Tasks>(
    tasks: &M,
    args: &Args,
    settings: &TrainSettings,
    seed: u64,
    workers: Box<dyn Workers>,
) -> anyhow::Result<Ready<Trainer<M::Env>>> {
    let (path, is_first) = (path_of(args, seed), workers.rank() == 0);
    let (description, settings) = (describe(tasks, args, seed)?, settings.clone());
    let start = args.start.as_ref().map(TrainedPolicy::load).transpose()?;
    let new = NewRun { description, settings, start, overwrite: args.overwrite };
    new.begin(tasks, path, args.threads.get(), workers, |trainer| {
        let Some(demos) = &args.demos else { return Ok(()) };
        options::add_demos(tasks, trainer, args, demos, seed)?;
        if is_first {
            say!("train: {} episodes of demonstrations", trainer.counters().demonstrations)?;
        }
        Ok(())
    })
}

/// Describes the run that the flags ask for.
fn describe(tasks: &impl Tasks, args: &Args, seed: u64) -> anyhow::Result<RunDescription> {
    let mut description = RunDescription::new(args.env_id, args.preset, seed);
    let (steps, target) = limits(args.env_id.task);
    description.model = args.model.of_run();
    description.steps = args.steps.unwrap_or(steps);
    description.target = args.target.unwrap_or(target);
    description.updates = args.updates;
    description.demos.clone_from(&args.demos);
    description.config = options::varied(tasks, args)?;
    description.changes = options::changes(args);
    Ok(description)
}
