//! The flags `--env-id`, `--seed`, `--model` and `--policy`.

use std::{fmt, str::FromStr};

use baselines::{Policy, RandomPolicy, ScriptedPolicy, ZeroPolicy};
use fetch_env::{EnvId, UnknownEnvId};
use fetch_sim::{ModelSource, Task};
use goal_reward::RewardKind;
use serde::Serialize;

/// Returns the name of a task in the names of files and arrays.
pub const fn task_name(task: Task) -> &'static str {
    match task {
        Task::Reach => "reach",
        Task::Push => "push",
        Task::PickAndPlace => "pick_and_place",
        Task::Slide => "slide",
    }
}

/// Returns the value of a flag as the user writes it.
pub fn flag_name(value: impl clap::ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// An environment and its seed.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct EnvArgs {
    /// Environment, or auto for FetchReachDense-v4
    #[arg(long, default_value_t = EnvChoice::Auto)]
    env_id: EnvChoice,
    /// Seed of resets, actions and goals
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
}

impl EnvArgs {
    pub fn id(&self) -> EnvId {
        self.env_id.id()
    }
}

/// An environment id, or `auto`: FetchReachDense-v4, as in the chapter.
#[derive(Clone, Copy, Debug)]
pub enum EnvChoice {
    Auto,
    Id(EnvId),
}

impl EnvChoice {
    pub fn id(self) -> EnvId {
        match self {
            Self::Auto => EnvId { task: Task::Reach, reward: RewardKind::Dense },
            Self::Id(id) => id,
        }
    }
}

impl FromStr for EnvChoice {
    type Err = UnknownEnvId;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text == "auto" { Ok(Self::Auto) } else { text.parse().map(Self::Id) }
    }
}

impl fmt::Display for EnvChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Id(id) => id.fmt(f),
        }
    }
}

/// The flag `--model`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelChoice {
    Builtin,
    Reference,
}

impl ModelChoice {
    pub fn source(self) -> ModelSource {
        match self {
            Self::Builtin => ModelSource::Builtin,
            Self::Reference => ModelSource::Reference,
        }
    }
}

/// The flag `--policy`: a policy that does not learn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PolicyChoice {
    /// Uniformly random actions
    Random,
    /// A few rules for each task
    Scripted,
    /// No action at all
    Zero,
}

impl PolicyChoice {
    /// Returns the policy for a task; only the random one needs the seed.
    pub fn policy(self, task: Task, seed: u64) -> Box<dyn Policy> {
        match self {
            Self::Random => Box::new(RandomPolicy::new(seed)),
            Self::Scripted => Box::new(ScriptedPolicy::new(task)),
            Self::Zero => Box::new(ZeroPolicy),
        }
    }
}
