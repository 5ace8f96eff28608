//! Trained policies in the real environment and in ours, on the same seeds.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::Context;
use baselines::{Episode, Policy, TrainedPolicy, evaluate, evaluate_vec};
use fetch_env::{EnvId, FetchObservation, Task, make, make_vec, vec_env::VecConfig};
use fetch_sim::ModelSource;
use serde::Serialize;

use super::{Found, npz::Npz};
use crate::shared::python;
use fetch_cli::shared::{
    check::{self, Check},
    choice::task_name,
    json::Metric,
};

const SCRIPT: &str = include_str!("../../scripts/policies.py");
/// The episodes on which the two models are compared: in Slide, one in ten ends differently on the
/// other model, so the rates over fewer episodes would differ by chance.
const MODEL_EPISODES: usize = 6_000;
/// The most by which their success rates may differ.
const MODEL_TOLERANCE: f64 = 0.01;

#[derive(clap::Args, Serialize)]
pub struct Args {
    /// Files of policies; by default those shipped with baselines
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    /// First seed of the episodes
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Episodes of each policy
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..))]
    episodes: u16,
}

/// Compares policies over episodes.
pub fn compare(args: &Args) -> anyhow::Result<Found> {
    let folder = tempfile::tempdir()?;
    let folder = folder.path();
    let files = if args.files.is_empty() { shipped(folder)? } else { args.files.clone() };
    let (episodes, first_seed) = (args.episodes, args.seed);
    say!("running {} policies in Python, {episodes} episodes each", files.len())?;
    let (episodes_text, seed_text) = (episodes.to_string(), first_seed.to_string());
    let absolute = |file: &PathBuf| {
        fs::canonicalize(file).with_context(|| format!("cannot find {}", file.display()))
    };
    let paths = files.iter().map(absolute).collect::<anyhow::Result<Vec<_>>>()?;
    let paths = paths.iter().map(|path| path.to_str().context("a path is not UTF-8"));
    let mut arguments = paths.collect::<anyhow::Result<Vec<_>>>()?;
    arguments.extend(["--episodes", &episodes_text, "--seed", &seed_text]);
    python::record(folder, SCRIPT, &arguments, "disable")?;
    let mut checks = Vec::new();
    for (number, file) in files.iter().enumerate() {
        let stem = file.file_stem().and_then(|stem| stem.to_str()).context("a file has no name")?;
        let theirs = Theirs::read(&folder.join(format!("{number}.npz")))?;
        let policy = TrainedPolicy::load(file)?;
        let own = [
            same_episodes(stem, &theirs, policy.clone(), first_seed)?,
            same_on_both_models(stem, policy, first_seed)?,
        ];
        check::print(&file.display().to_string(), &own)?;
        checks.extend(own);
    }
    Ok(Found::of_checks("policies/", checks))
}

/// Writes the policies shipped with `baselines` to a folder.
fn shipped(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let write = |task| {
        let path = folder.join(format!("{}.safetensors", task_name(task)));
        fs::write(&path, TrainedPolicy::shipped(task)?.to_bytes()?)?;
        Ok(path)
    };
    Task::ALL.into_iter().map(write).collect()
}

/// The episodes of the real environment.
struct Theirs {
    successes: Vec<f64>,
    final_distances: Vec<f64>,
    actions: Vec<f32>,
}

impl Theirs {
    fn read(path: &Path) -> anyhow::Result<Self> {
        let mut file = Npz::open(path)?;
        Ok(Self {
            successes: file.array("success")?.0,
            final_distances: file.array("final_distance")?.0,
            actions: file.array("actions")?.0,
        })
    }
}

/// Runs the same episodes on the reference's model.
fn same_episodes(
    name: &str,
    theirs: &Theirs,
    mut policy: TrainedPolicy,
    first_seed: u64,
) -> anyhow::Result<Check> {
    let env_id: EnvId = policy.header().env_id.parse()?;
    let mut env = make(env_id.config().with_model(ModelSource::Reference))?;
    let mut actions = Vec::new();
    let mut recorded = |observation: &FetchObservation, action: &mut [f32]| {
        policy.act(observation, action);
        actions.extend_from_slice(action);
    };
    let count = theirs.successes.len();
    let ours = evaluate(&mut env, &mut recorded, count, first_seed, |_| ())?.episodes;
    let len = actions.len() / count;
    let is_equal = |(at, episode): (usize, &Episode)| {
        let bits = |actions: &[f32]| actions.iter().map(|a| a.to_bits()).collect::<Vec<_>>();
        let place = at * len..(at + 1) * len;
        episode.final_distance == theirs.final_distances[at]
            && theirs.actions.get(place.clone()).is_some_and(|a| bits(a) == bits(&actions[place]))
    };
    let equal = ours.iter().enumerate().filter(|pair| is_equal(*pair)).count();
    let pairs = ours.iter().zip(&theirs.successes);
    let different = pairs.filter(|(ours, theirs)| ours.success != (**theirs != 0.0)).count();
    let here = ours.iter().filter(|episode| episode.success).count();
    let there: f64 = theirs.successes.iter().sum();
    Ok(Check::none_of(
        format!("{name}/real-environment"),
        different,
        format!(
            "{there} of {count} episodes succeed there, {here} here, {different} differ; \
             {equal} are equal to the last bit"
        ),
    ))
}

/// Runs episodes on both models.
fn same_on_both_models(
    name: &str,
    policy: TrainedPolicy,
    first_seed: u64,
) -> anyhow::Result<Check> {
    let env_id: EnvId = policy.header().env_id.parse()?;
    let rate = |model: ModelSource| -> anyhow::Result<f64> {
        let config = env_id.config().with_model(model);
        let mut envs = make_vec(config, 20, VecConfig::default())?;
        let mut policy = policy.clone();
        let evaluation = evaluate_vec(&mut envs, &mut policy, MODEL_EPISODES, first_seed, |_| ())?;
        Ok(evaluation.summary()?.success_rate.value)
    };
    let (builtin, reference) = (rate(ModelSource::Builtin)?, rate(ModelSource::Reference)?);
    let difference = (builtin - reference).abs();
    Ok(Check::new(
        format!("{name}/models"),
        // Beyond the rounding of the two rates.
        difference <= MODEL_TOLERANCE + 1e-9,
        format!(
            "{builtin:.3} of {MODEL_EPISODES} episodes succeed on the built-in model, \
             {reference:.3} on the reference's"
        ),
        Metric::new(difference, "1"),
    ))
}
