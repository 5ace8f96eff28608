//! Compares recorded distributions of the real environment with ours, on the same seeds and
//! actions.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, ensure};
use baselines::statistics::{fisher_exact, kolmogorov_smirnov, wilcoxon};
use baselines::{ScriptedPolicy, evaluate};
use fetch_env::{Env, EnvId, FetchEnv, GoalObservation, NpRandom};
use fetch_sim::{FetchModel, MujocoSimulator, MujocoVersion, Simulator, Task};
use goal_reward::RewardKind;
use indicatif::ProgressBar;
use serde::Serialize;

use super::{Found, Models, counting::counting, npz::Npz};
use fetch_cli::shared::{
    check::{self, Check},
    choice::{ModelChoice, task_name},
    json::Metric,
    progress,
};

/// The seeds of the recordings: episode `e` was reset with the first plus `e`, and numpy's
/// generator drew its actions with the second plus `e`.
const FIRST_RESET_SEED: u64 = 10_000;
const FIRST_ACTION_SEED: u64 = 20_000;

const STEPS: usize = 50;

/// The p-value below which two distributions count as different.
const LEAST_P_VALUE: f64 = 0.01;

/// The figures of an episode: the name of each, and the recorded array and column that holds it.
const FIGURES: [(&str, &str, usize); 11] = [
    ("goal-x", "goal", 0),
    ("goal-y", "goal", 1),
    ("goal-z", "goal", 2),
    ("object-x", "object_xy", 0),
    ("object-y", "object_xy", 1),
    ("return-dense", "return_dense", 0),
    ("return-sparse", "return_sparse", 0),
    ("final-distance", "final_distance", 0),
    ("contacts-per-step", "contacts_per_step", 0),
    ("success-last", "success_last", 0),
    ("success-any", "success_any", 0),
];
const RETURN_DENSE: usize = 5;

/// Each of the [`FIGURES`] in every episode; none where there is no object.
type Sample = [Vec<f64>; FIGURES.len()];

#[derive(clap::Args, Serialize)]
pub struct Args {
    /// File of recorded distributions (*.npz)
    file: PathBuf,
    /// Episodes of each task
    #[arg(long, default_value_t = 400, value_parser = clap::value_parser!(u16).range(1..))]
    episodes: u16,
    /// Model on which to run them
    #[arg(long, value_enum, default_value = "builtin")]
    model: ModelChoice,
}

/// Compares every task.
pub fn compare(args: &Args) -> anyhow::Result<Found> {
    let episodes = args.episodes.into();
    let mut models = Models::new(args.model.source());
    let bar = progress::bar(Task::ALL.len() * episodes, "distributions");
    let mut all = Vec::new();
    for task in Task::ALL {
        let checks = compare_task(&args.file, task, models.get(task)?, episodes, &bar)?;
        bar.suspend(|| check::print(&format!("{task}, {episodes} episodes"), &checks))?;
        all.extend(checks);
    }
    bar.finish_and_clear();
    Ok(Found::of_checks("distributions/", all))
}

/// Compares a task over the first `episodes` recorded episodes.
fn compare_task(
    path: &Path,
    task: Task,
    model: Arc<FetchModel>,
    episodes: usize,
    bar: &ProgressBar,
) -> anyhow::Result<Vec<Check>> {
    let theirs = read(path, task, episodes)
        .with_context(|| format!("{} does not hold recorded distributions", path.display()))?;
    let ours = run(MujocoSimulator::from_model(Arc::clone(&model))?, episodes, bar)?;
    let mut checks = Vec::new();
    for ((name, ..), (ours, theirs)) in FIGURES.into_iter().zip(ours.iter().zip(&theirs)) {
        match name {
            _ if theirs.is_empty() => {}
            "success-last" | "success-any" => checks.push(same_share(task, name, ours, theirs)?),
            _ => {
                checks.push(same_distribution(task, name, ours, theirs)?);
                checks.push(same_episodes(task, name, ours, theirs)?);
            }
        }
    }
    checks.push(same_mean_return(task, &ours[RETURN_DENSE], &theirs[RETURN_DENSE]));
    checks.push(same_scripted_success(task, MujocoSimulator::from_model(model)?, episodes)?);
    Ok(checks)
}

/// Checks that the scripted policy succeeds as often as on the reference's own model.
fn same_scripted_success(
    task: Task,
    simulator: MujocoSimulator,
    episodes: usize,
) -> anyhow::Result<Check> {
    let mujoco = MujocoVersion::of_library()?.to_string();
    let successes_there = scripted_successes(task, &mujoco)
        .with_context(|| format!("no scripted episodes were recorded on MuJoCo {mujoco}"))?;
    let config = EnvId { task, reward: RewardKind::Sparse }.config();
    let mut env = FetchEnv::new(config, simulator)?.time_limited();
    let mut policy = ScriptedPolicy::new(task);
    let episodes = episodes.min(SCRIPTED_EPISODES);
    let evaluation = evaluate(&mut env, &mut policy, episodes, FIRST_SCRIPTED_SEED, |_| ())?;
    let successes = evaluation.episodes.iter().filter(|e| e.success).count() as u64;
    let p = fisher_exact(successes, episodes as u64, successes_there, SCRIPTED_EPISODES as u64)?;
    let seen = format!(
        "{successes} of {episodes}, reference {successes_there} of {SCRIPTED_EPISODES}; Fisher's \
         p = {p:.3}"
    );
    Ok(Check::of_test(format!("{task}/scripted-success"), p, LEAST_P_VALUE, seen))
}

/// The scripted episodes on the reference's own model, whose resets have the seeds from
/// [`FIRST_SCRIPTED_SEED`] on.
const SCRIPTED_EPISODES: usize = 300;
const FIRST_SCRIPTED_SEED: u64 = 30_000;

/// Returns how many of the [`SCRIPTED_EPISODES`] ended in success on the reference's own model;
/// `None` on a MuJoCo on which they were not recorded.
fn scripted_successes(task: Task, mujoco: &str) -> Option<u64> {
    match (mujoco, task) {
        ("2.2.2" | "3.6.0", Task::Reach | Task::PickAndPlace) => Some(300),
        ("2.2.2", Task::Push) => Some(286),
        ("2.2.2", Task::Slide) => Some(49),
        ("3.6.0", Task::Push) => Some(300),
        ("3.6.0", Task::Slide) => Some(65),
        _ => None,
    }
}

/// Applies the two-sample Kolmogorov-Smirnov test.
fn same_distribution(
    task: Task,
    name: &str,
    ours: &[f64],
    theirs: &[f64],
) -> anyhow::Result<Check> {
    let (statistic, p) = kolmogorov_smirnov(&rounded(ours), &rounded(theirs))?;
    let seen = format!(
        "mean {:.4}, recorded {:.4}; Kolmogorov-Smirnov D = {statistic:.4}, p = {p:.3}",
        mean(ours),
        mean(theirs)
    );
    let metric = Metric::new(statistic, "1");
    Ok(Check::new(format!("{task}/{name}"), p >= LEAST_P_VALUE, seen, metric))
}

/// Applies Wilcoxon's test to the pairs of episodes with the same seed, which shows a shift that is
/// small beside the differences between episodes.
fn same_episodes(task: Task, name: &str, ours: &[f64], theirs: &[f64]) -> anyhow::Result<Check> {
    let (ours, theirs) = (rounded(ours), rounded(theirs));
    let differing = ours.iter().zip(&theirs).filter(|(a, b)| a != b).count();
    let (_, p) = wilcoxon(&ours, &theirs)?;
    let seen = format!(
        "{differing} of {} pairs differ by more than 1e-6; Wilcoxon's p = {p:.3}",
        ours.len()
    );
    Ok(Check::of_test(format!("{task}/{name}-pairs"), p, LEAST_P_VALUE, seen))
}

/// Rounds to 1e-6: if all goals have one height, a nanometer would make the distributions disjoint.
fn rounded(sample: &[f64]) -> Vec<f64> {
    sample.iter().map(|x| (x * 1e6).round() * 1e-6).collect()
}

fn same_share(task: Task, name: &str, ours: &[f64], theirs: &[f64]) -> anyhow::Result<Check> {
    let count = |sample: &[f64]| sample.iter().filter(|value| **value > 0.0).count() as u64;
    let (a, b) = (count(ours), count(theirs));
    let p = fisher_exact(a, ours.len() as u64, b, theirs.len() as u64)?;
    let seen =
        format!("{a} of {}, recorded {b} of {}; Fisher's p = {p:.3}", ours.len(), theirs.len());
    Ok(Check::of_test(format!("{task}/{name}"), p, LEAST_P_VALUE, seen))
}

/// Checks that the mean returns, of the same episodes, are within 2 % of each other.
fn same_mean_return(task: Task, ours: &[f64], theirs: &[f64]) -> Check {
    let (a, b) = (mean(ours), mean(theirs));
    let off = (a / b - 1.0).abs();
    let equal = ours.iter().zip(theirs).filter(|(a, b)| a.to_bits() == b.to_bits()).count();
    let close = ours.iter().zip(theirs).filter(|(a, b)| (*a - *b).abs() < 1e-6).count();
    let seen = format!(
        "{a:.4}, recorded {b:.4}: {:.2} % off; of {} episodes {equal} equal to the last bit, \
         {close} to 1e-6",
        100.0 * off,
        ours.len()
    );
    Check::new(format!("{task}/mean-return"), off <= 0.02, seen, Metric::new(off, "1"))
}

fn mean(sample: &[f64]) -> f64 {
    sample.iter().sum::<f64>() / sample.len() as f64
}

fn read(path: &Path, task: Task, episodes: usize) -> anyhow::Result<Sample> {
    let mut file = Npz::open(path)?;
    let mut sample = Sample::default();
    for ((_, name, index), column) in FIGURES.into_iter().zip(&mut sample) {
        if name == "object_xy" && !task.has_object() {
            continue;
        }
        let (values, shape) = file.array::<f64>(&format!("{}_{name}", task_name(task)))?;
        let width = shape.get(1).copied().unwrap_or(1);
        ensure!(index < width && (name != "goal" || width == 3), "{name} has the shape {shape:?}");
        ensure!(shape[0] >= episodes, "{} episodes were recorded, not {episodes}", shape[0]);
        *column = values.into_iter().skip(index).step_by(width).take(episodes).collect();
    }
    Ok(sample)
}

fn run(simulator: MujocoSimulator, episodes: usize, bar: &ProgressBar) -> anyhow::Result<Sample> {
    let config = EnvId { task: simulator.task(), reward: RewardKind::Dense }.config();
    let threshold = config.distance_threshold().get();
    let mut env = FetchEnv::new(config, counting(simulator)?)?;
    let mut sample = Sample::default();
    for episode in 0..episodes as u64 {
        let mut actions = NpRandom::new(FIRST_ACTION_SEED + episode);
        let first = env.reset(Some(FIRST_RESET_SEED + episode))?.observation;
        let (mut dense, mut sparse, mut contacts, mut any) = (0.0, 0.0, 0, false);
        let mut distance = f64::NAN;
        let mut success = false;
        for _ in 0..STEPS {
            let action: [f32; 4] = std::array::from_fn(|_| actions.uniform(-1.0, 1.0) as f32);
            let step = env.step(&action)?;
            distance = step.info.distance;
            success = step.info.is_success;
            any |= success;
            dense += step.reward;
            sparse -= f64::from(u8::from(distance > threshold));
            contacts += env.simulator().simulator.data().contacts().count();
        }
        let contacts = contacts as f64 / STEPS as f64;
        let outcome = [dense, sparse, distance, contacts, success.into(), any.into()];
        let (starts, outcomes) = sample.split_at_mut(FIGURES.len() - outcome.len());
        let object = first.object_position();
        let object = object.iter().flat_map(|position| &position[..2]);
        for (column, value) in starts.iter_mut().zip(first.desired_goal().iter().chain(object)) {
            column.push(*value);
        }
        for (column, value) in outcomes.iter_mut().zip(outcome) {
            column.push(value);
        }
        bar.inc(1);
    }
    Ok(sample)
}
