//! The flag `--policy`.

use baselines::{Policy, RandomPolicy, ScriptedPolicy, ZeroPolicy};
use fetch_env::Task;

/// A policy that does not learn.
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
    pub const fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Scripted => "scripted",
            Self::Zero => "zero",
        }
    }

    /// The policy for a task; only the random one needs the seed.
    pub fn policy(self, task: Task, seed: u64) -> Box<dyn Policy> {
        match self {
            Self::Random => Box::new(RandomPolicy::new(seed)),
            Self::Scripted => Box::new(ScriptedPolicy::new(task)),
            Self::Zero => Box::new(ZeroPolicy),
        }
    }
}
