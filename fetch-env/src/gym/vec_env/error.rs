//! Errors of environments that are stepped together.

use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Error returned when a [`VecEnv`](crate::VecEnv) cannot be made or a call is invalid.
///
/// The call has then changed nothing. A failure of a single environment is not such an error: see
/// [`VecStep::error`](crate::vec_env::VecStep::error).
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VecEnvError {
    /// No environment was passed.
    #[error("there is no environment: pass at least one")]
    NoEnvs,
    /// More environments than a vector takes.
    #[error("there are more than {most} environments: make several vectors of at most {most}")]
    TooManyEnvs {
        /// The largest number of environments.
        most: usize,
    },
    /// More threads than a vector takes.
    #[error("a vector would have {threads} threads: set num_threads to at most {most}")]
    TooManyThreads {
        /// The number of threads, at most one for each environment.
        threads: usize,
        /// The largest number of threads.
        most: usize,
    },
    /// The spaces of an environment differ from the first one's.
    #[error(
        "the spaces of environment {env_index} differ from environment 0's: make them all alike"
    )]
    SpacesDiffer {
        /// Id of the environment.
        env_index: usize,
    },
    /// The next episodes have begun, and the last states are gone.
    #[error("the same step begins the next episodes: complete results in another autoreset mode")]
    Begun,
    /// The observation space does not describe the observations.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// Too many or too few actions.
    #[error(
        "{actual} numbers are not {rows} actions of {action_len}: pass one row per environment"
    )]
    ActionCount {
        /// Number of actions needed.
        rows: usize,
        /// Number of elements of an action.
        action_len: usize,
        /// Number of elements passed.
        actual: usize,
    },
    /// No environment has this id.
    #[error("there is no environment {env_index}: pass ids from 0 to {}", num_envs - 1)]
    UnknownEnv {
        /// The id.
        env_index: usize,
        /// Number of environments.
        num_envs: usize,
    },
    /// A step of an environment that was never reset.
    #[error(
        "environment {env_index} was never reset: call reset() or send_reset() before its first \
         step"
    )]
    ResetNeeded {
        /// Id of the environment.
        env_index: usize,
    },
    /// The environment is in flight, or named twice in one call.
    #[error("environment {env_index} is in flight: send to it again only after recv() returns it")]
    EnvInFlight {
        /// Id of the environment.
        env_index: usize,
    },
    /// A call for all environments while some are in flight.
    #[error("{count} environments are in flight: recv() them before step() or reset()")]
    InFlight {
        /// Number of environments in flight.
        count: usize,
    },
    /// A batch larger than the number of environments in flight.
    #[error(
        "a batch of {batch_size} can never be complete: ask for at most the {in_flight} in flight"
    )]
    BatchTooLarge {
        /// Size of the batch.
        batch_size: usize,
        /// Number of environments in flight.
        in_flight: usize,
    },
    /// Seeds, a mask, options or a snapshot for another number of environments.
    #[error("{what} has {actual} elements for {num_envs} environments: pass one for each")]
    Count {
        /// `seeds`, `mask`, `options` or `snapshot`.
        what: &'static str,
        /// Number of elements passed.
        actual: usize,
        /// Number of environments.
        num_envs: usize,
    },
    /// An environment that has panicked has no state.
    #[error("environment {env_index} has panicked and is out of use: make new environments")]
    OutOfUse {
        /// Id of the environment.
        env_index: usize,
    },
    /// A snapshot of other environments.
    #[error("the snapshot does not fit environment {env_index}: {reason}")]
    ForeignSnapshot {
        /// Id of the environment.
        env_index: usize,
        /// Message of the environment's error.
        reason: String,
    },
    /// A mask that selects no environment.
    #[error("the mask resets no environment: set at least one element")]
    EmptyMask,
    /// The seed of the last environment exceeds 64 bits.
    #[error(
        "the seeds from {first} on for {num_envs} environments exceed 64 bits: pass a smaller one"
    )]
    SeedTooLarge {
        /// Seed of the first environment.
        first: u64,
        /// Number of environments.
        num_envs: usize,
    },
    /// The operating system could not start a thread.
    #[error("a worker thread could not be started ({reason}): use fewer threads")]
    Thread {
        /// The operating system's message.
        reason: String,
    },
    /// This system cannot pin threads.
    #[error("the threads cannot be pinned to cores on this system: leave pin_threads off")]
    Pinning,
    /// The environments were made before a `fork`, and this process is the child, which has none of
    /// their threads. Every call that needs these returns this error.
    #[error(
        "the environments were made in another process, from which this one was forked without \
         their threads: make new environments in this process"
    )]
    Forked,
    /// A worker thread died, and an environment with it.
    #[error("a worker thread died: make new environments")]
    WorkerLost,
}

debug_as_display!(VecEnvError);

impl From<VecEnvError> for EnvError {
    fn from(error: VecEnvError) -> Self {
        Self::other(error)
    }
}
