//! The settings that the flags describe, and demonstrations.

use std::{fmt::Display, io::Cursor, mem::take, time::Duration};

use anyhow::Context;
use baselines::{
    Policy, ScriptedPolicy,
    learn::{AlgorithmSettings, DdpgSettings, SacSettings, TrainSettings, Trainer},
    workers::share,
};
use fetch_env::variation::{Draw, Variation};
use fetch_env::{FetchConfig, FetchObservation, GoalEnv};
use goal_reward::GoalReward;
use her_relabel::{GoalColumns, HerBuffer, LoadError, NpzError, files::read};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Args;
use crate::output::usage;
use crate::shared::choice::{ModelChoice, flag_name};
use crate::shared::{episodes::check_variation, tasks::Tasks};

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum AlgorithmChoice {
    /// Deep deterministic policy gradient
    Ddpg,
    /// Soft actor-critic
    Sac,
}

/// Noise that a policy learns to stand, by its standard deviation.
#[derive(Clone, Copy, Debug)]
pub enum Noise {
    /// On what the actor sees; the critic learns from exact observations.
    Observation(f64),
    /// On the environment's actions.
    Action(f64),
}

/// Reads a value of `--noise`.
pub fn noise(text: &str) -> Result<Noise, String> {
    let (name, std) = text.split_once('=').ok_or("write NAME=NUMBER")?;
    let noise = match name {
        "observation" => Noise::Observation,
        "action" => Noise::Action,
        _ => return Err("choose observation or action; --vary has other noise".into()),
    };
    let std: f64 = std.parse().map_err(|error| format!("{error}"))?;
    let is_valid = (0.0..=100.0).contains(&std);
    is_valid.then(|| noise(std)).ok_or_else(|| "choose a number from 0 to 100".into())
}

/// Returns the flags with the settings and factors that `--noise` stands for.
pub fn with_noise(args: &Args) -> Args {
    let mut args = args.clone();
    for noise in take(&mut args.noise) {
        match noise {
            Noise::Observation(std) => args.set.push(format!("actor_observation_noise={std}")),
            Noise::Action(std) => args.vary.push(format!("action_noise={std}")),
        }
    }
    args
}

/// Returns what all ranks of a run must have in common, besides the settings.
pub fn facts(args: &Args) -> [(&'static str, String); 12] {
    [
        ("command", "train".to_owned()),
        ("--env-id", args.env_id.to_string()),
        ("--model", flag_name(args.model)),
        ("--seed", args.seed.to_string()),
        ("--seeds", args.seeds.to_string()),
        ("--steps", format!("{:?}", args.steps)),
        ("--updates", format!("{:?}", args.updates)),
        ("--target", format!("{:?}", args.target)),
        ("--demos", format!("{:?}", args.demos)),
        ("--start", format!("{:?}", args.start)),
        ("--vary", format!("{:?}", args.vary)),
        ("--resume", format!("{:?}", args.resume)),
    ]
}

/// Returns the settings that the flags describe.
pub fn settings(args: &Args) -> anyhow::Result<TrainSettings> {
    let mut settings = args.preset.settings(args.env_id.task);
    match (args.algorithm, &settings.algorithm) {
        (Some(AlgorithmChoice::Ddpg), AlgorithmSettings::Sac(_)) => {
            settings.algorithm = AlgorithmSettings::Ddpg(DdpgSettings::default());
        }
        (Some(AlgorithmChoice::Sac), AlgorithmSettings::Ddpg(_)) => {
            settings.algorithm = AlgorithmSettings::Sac(SacSettings::default());
        }
        (Some(algorithm), AlgorithmSettings::Ppo(_)) => {
            let (preset, algorithm) = (args.preset, flag_name(algorithm));
            return Err(usage(format_args!(
                "--algorithm {algorithm}: --preset {preset} has PPO: leave one out"
            )));
        }
        _ => {}
    }
    if let Some(num_envs) = args.envs {
        settings.schedule.num_envs = num_envs.get();
    }
    if args.student.pixels {
        settings = settings.with_pixels(args.env_id.task);
    }
    for assignment in &args.set {
        settings = settings
            .with(assignment)
            .map_err(|error| usage(format_args!("--set {assignment}: {error}")))?;
    }
    settings.check().map_err(usage)?;
    Ok(settings)
}

/// Returns the settings of the environment whose factors vary, if `--vary` names any.
pub fn varied(tasks: &impl Tasks, args: &Args) -> anyhow::Result<Option<FetchConfig>> {
    if args.vary.is_empty() {
        return Ok(None);
    }
    let mut variation = Variation::default();
    for text in &args.vary {
        let wrong = |error: &dyn Display| usage(format_args!("--vary {text}: {error}"));
        let (name, draw) = text.split_once('=').ok_or_else(|| wrong(&"write NAME=DRAW"))?;
        let draw: Draw = draw.parse().map_err(|error| wrong(&error))?;
        variation = variation.with(name, draw).map_err(|error| wrong(&error))?;
    }
    let config = args.env_id.config().with_variation(variation);
    check_variation(tasks, &config.clone().with_model(args.model.source()))?;
    Ok(Some(config))
}

/// Returns the flags of a run that change what the preset says.
pub fn changes(args: &Args) -> Vec<String> {
    let algorithm = args.algorithm.map(flag_name);
    let num_envs = args.envs.map(|envs| format!("envs={envs}"));
    let model = (args.model != ModelChoice::Builtin).then(|| flag_name(args.model));
    let flags = [algorithm, num_envs, model].into_iter().flatten();
    flags.chain(args.set.iter().chain(&args.vary).cloned()).collect()
}

/// The noise of scripted episodes, so that the policy also sees the results of mistakes.
const DEMO_NOISE: f32 = 0.1;
/// The seed of the first demonstration of the first run, which no training or evaluation uses.
const DEMO_SEED: u64 = 1 << 45;

/// Returns the episodes of a saved buffer as an archive of numpy arrays.
fn archive_of(saved: &str) -> anyhow::Result<Vec<u8>> {
    let mut archive = Cursor::new(Vec::new());
    match HerBuffer::<f32>::load(saved) {
        Ok(buffer) => buffer.write_npz(&mut archive)?,
        Err(LoadError::ElementSize { .. }) => {
            HerBuffer::<f64>::load(saved)?.write_npz(&mut archive)?;
        }
        Err(error) => return Err(error.into()),
    }
    Ok(archive.into_inner())
}

/// The largest size of an archive of demonstrations, in bytes.
const MOST_BYTES: u64 = 16 << 30;

/// The largest number of scripted demonstrations, which take about 30 s.
const MOST_DEMOS: usize = 10_000;

/// Checks the value of `--demos`, if it is a number and not a file.
pub fn demos(text: &str) -> Result<String, String> {
    let is_count = text.parse::<usize>().is_ok_and(|count| count <= MOST_DEMOS);
    if is_count || text.parse::<f64>().is_err() {
        Ok(text.to_owned())
    } else {
        Err(format!("choose a whole number from 0 to {MOST_DEMOS}, or a file"))
    }
}

/// Checks the value of `--target`; `run.json` has no other numbers.
pub fn target(text: &str) -> Result<f64, String> {
    let target: f64 = text.parse().map_err(|error| format!("{error}"))?;
    target.is_finite().then_some(target).ok_or_else(|| "choose a finite number".into())
}

/// Reads the value of `--checkpoint-seconds`.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|error| format!("{error}"))?;
    Duration::try_from_secs_f64(seconds).map_err(|_| "choose a number from 0 on".into())
}

/// Where data sets of OGBench's format have the goals.
const GOALS: GoalColumns<'_> = GoalColumns {
    array: "achieved_goals",
    width: 3,
    columns: 0..3,
    desired: Some("desired_goals"),
};

/// Adds the episodes of an archive of numpy arrays: of a buffer, or in OGBench's format, which does
/// not store the lengths of episodes.
fn import(
    buffer: &mut HerBuffer<f32>,
    archive: &[u8],
    reward: &impl GoalReward,
) -> Result<u64, NpzError> {
    let missing = match buffer.import_npz_bytes(archive) {
        Err(missing @ NpzError::Missing { .. }) => missing,
        imported => return imported,
    };
    match buffer.import_ogbench_bytes(archive, &GOALS, reward) {
        Err(NpzError::Missing { .. }) => Err(missing),
        imported => imported,
    }
}

/// Adds demonstrations to the buffer of a trainer: this rank's share of scripted episodes, or all
/// episodes of a file.
pub fn add_demos<M: Tasks>(
    tasks: &M,
    trainer: &mut Trainer<M::Env>,
    args: &Args,
    demos: &str,
    seed: u64,
) -> anyhow::Result<()> {
    let Ok(count) = demos.parse::<usize>() else {
        let archive = if demos.ends_with(".npz") {
            read(demos, MOST_BYTES)
                .with_context(|| format!("--demos {demos}: cannot read the archive"))?
        } else {
            archive_of(demos).with_context(|| {
                format!("--demos {demos}: pass a number, an archive .npz or a saved buffer")
            })?
        };
        let env = tasks.make(args.env_id.config().with_model(args.model.source()))?;
        let reward = env.goal_reward();
        trainer.add_demonstrations(|buffer| anyhow::Ok(import(buffer, &archive, reward)?))?;
        return Ok(());
    };
    let own = share(trainer.workers(), count);
    let mut env = tasks.make(args.env_id.config().with_model(args.model.source()))?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(trainer.workers().rank() as u64);
    let mut script = ScriptedPolicy::new(args.env_id.task);
    let mut noisy = |observation: &FetchObservation, action: &mut [f32]| {
        script.act(observation, action);
        for element in action {
            let noise = rng.random_range(-DEMO_NOISE..=DEMO_NOISE);
            *element = (*element + noise).clamp(-1.0, 1.0);
        }
    };
    let first_seed = DEMO_SEED.wrapping_add(seed.wrapping_mul(100_000));
    let first_seed = first_seed.wrapping_add(own.start as u64);
    trainer.add_demonstrations(|buffer| {
        let count = own.len();
        anyhow::Ok(baselines::collect(&mut env, &mut noisy, count, first_seed, buffer, 0, |_| ())?)
    })?;
    Ok(())
}
