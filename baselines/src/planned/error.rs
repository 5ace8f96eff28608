//! The errors of planning.

use fetch_env::EnvError;

use crate::policy::PolicyError;

/// Error returned by a [`Planner`](crate::Planner).
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum PlannerError {
    /// A setting is out of its range.
    #[error("the setting {name} is {value}: {expected}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: String,
        /// What to choose.
        expected: &'static str,
    },
    /// There is no environment to simulate in.
    #[error("there is no environment to simulate in: pass one for each thread")]
    NoEnvironment,
    /// There are more environments than threads.
    #[error("there are {actual} environments, each with its thread: pass at most {most}")]
    TooManyEnvironments {
        /// The number of environments.
        actual: usize,
        /// The largest number.
        most: usize,
    },
    /// An element of the action has no finite bounds for the search to draw it between.
    #[error(
        "element {index} of an action lies between {low} and {high}: give the environment's \
         action space finite bounds"
    )]
    Unbounded {
        /// The element, counted from 0.
        index: usize,
        /// Its lower bound.
        low: f32,
        /// Its upper bound.
        high: f32,
    },
    /// The first policy, or that of the task, does not fit this environment.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// An environment could not be restored or stepped.
    #[error("an episode could not be simulated")]
    Environment(#[from] EnvError),
    /// A thread could not be started.
    #[error("a thread could not be started ({reason}): pass fewer environments")]
    Thread {
        /// The operating system's message.
        reason: String,
    },
}

debug_as_display!(PlannerError);
