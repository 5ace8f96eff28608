//! The flags `--model` and `--policy`.

use std::path::Path;

use baselines::{
    AnyPolicy, OnMujoco, PixelPolicy, Policy, ProportionalPolicy, RandomPolicy, ScriptedPolicy,
    TrainedPolicy, ZeroPolicy, runs::RunModel,
};
use clap::ValueEnum;
use fetch_sim::{ModelSource, Task};
use serde::{Deserialize, Serialize};

use super::folders::runs_in;
use crate::output::usage;

/// Returns the name of a task in the names of files and arrays, which is the name of its scene.
pub fn task_name(task: Task) -> &'static str {
    task.spec().scene_file.trim_end_matches(".xml")
}

/// Returns the value of a flag as the user writes it.
pub fn flag_name(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// The flag `--model`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelChoice {
    /// The project's own, built in
    Builtin,
    /// The reference's own, which `fetch-env assets` fetches
    Reference,
}

impl ModelChoice {
    /// Returns the source of the model.
    pub fn source(self) -> ModelSource {
        match self {
            Self::Builtin => ModelSource::Builtin,
            Self::Reference => ModelSource::Reference,
        }
    }

    /// Returns the model as a run's description has it.
    pub fn of_run(self) -> RunModel {
        match self {
            Self::Builtin => RunModel::Builtin,
            Self::Reference => RunModel::Reference,
        }
    }
}

/// The flag `--policy`: a policy that needs no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PolicyChoice {
    /// Uniformly random actions
    Random,
    /// The gripper straight to the goal
    Proportional,
    /// A few rules for each task
    Scripted,
    /// Learned by `fetch-env train`, for each task
    Trained,
    /// Learned in a world that varies, for Push and PickAndPlace
    Robust,
    /// No action at all
    Zero,
}

impl PolicyChoice {
    /// Returns the policy for an environment; only the random one needs the seed.
    ///
    /// # Errors
    /// The trained policy of the task cannot be read.
    pub fn policy(self, env: &impl OnMujoco, seed: u64) -> anyhow::Result<Box<dyn Policy>> {
        let task = env.config().task();
        Ok(match self {
            Self::Random => Box::new(RandomPolicy::new(env.action_space(), seed)),
            Self::Proportional => Box::new(ProportionalPolicy::new(task)),
            Self::Scripted => Box::new(ScriptedPolicy::new(task)),
            Self::Trained => Box::new(TrainedPolicy::shipped(task)?),
            Self::Robust => Box::new(TrainedPolicy::robust(task)?),
            Self::Zero => Box::new(ZeroPolicy),
        })
    }
}

/// The value of `--policy` for the policies that see pictures and come with the program.
pub const PIXELS: &str = "pixels";

/// Returns the policies of the runs in a folder as their files, or else the name or file itself.
///
/// # Errors
/// The folder cannot be read, or has no run.
pub fn policies_of(text: &str) -> anyhow::Result<Vec<String>> {
    if PolicyChoice::from_str(text, false).is_ok() || !Path::new(text).is_dir() {
        return Ok(vec![text.to_owned()]);
    }
    let runs = runs_in(text.as_ref())?;
    Ok(runs.iter().map(|run| run.join("policy.safetensors").display().to_string()).collect())
}

/// Returns the policy that a name or a file stands for, if it sees pictures.
///
/// # Errors
/// The file is not a policy, or no policy of the task comes with the program.
pub fn pixel_policy_of(text: &str, task: Task) -> anyhow::Result<Option<PixelPolicy>> {
    if text == PIXELS {
        #[cfg(feature = "pixel-policies")]
        return Ok(Some(PixelPolicy::shipped(task)?));
        #[cfg(not(feature = "pixel-policies"))]
        return Err(usage(format_args!(
            "no policy of {task} that sees pictures is in this build: pass the file of one"
        )));
    }
    if !Path::new(text).is_file() {
        return Ok(None);
    }
    match AnyPolicy::load(text)? {
        AnyPolicy::Pixels(policy) => Ok(Some(*policy)),
        _ => Ok(None),
    }
}

/// Returns the policy that a name or a file stands for; `proportional=GAIN` has that gain.
///
/// # Errors
/// There is no policy of this name, or the file is not one.
pub fn policy_of(text: &str, env: &impl OnMujoco, seed: u64) -> anyhow::Result<Box<dyn Policy>> {
    if let Ok(choice) = PolicyChoice::from_str(text, false) {
        return choice.policy(env, seed);
    }
    if let Some(gain) = text.strip_prefix("proportional=") {
        let finite = gain.parse().ok().filter(|gain: &f64| gain.is_finite());
        let gain =
            finite.ok_or_else(|| usage(format_args!("{gain} is no gain: write a number")))?;
        let policy = ProportionalPolicy::new(env.config().task());
        return Ok(Box::new(policy.with_gain(gain)));
    }
    if !text.contains(['.', '/']) {
        return Err(usage(format_args!(
            "there is no policy {text}: choose random, proportional, scripted, trained, robust, \
             zero or the file of a trained one"
        )));
    }
    Ok(Box::new(TrainedPolicy::load(text)?))
}

/// Returns the policy of an episode: if it is the random one, one that the episode's seed alone
/// decides, so that episodes can be shared out.
pub fn acting<'a>(
    name: &str,
    random: &'a mut RandomPolicy,
    policy: &'a mut dyn Policy,
) -> &'a mut dyn Policy {
    if name == "random" { random } else { policy }
}
