/// Why a [`VecEnv`](super::VecEnv) could not be made or called. Nothing has changed then.
///
/// What goes wrong in one environment is no such error: see [`Batch::error`](super::Batch::error).
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum VecEnvError {
    /// There is no environment.
    #[error("there is no environment: pass at least one")]
    NoEnvs,
    /// An environment has other spaces than the first.
    #[error("environment {env_id} has other spaces than environment 0: make all of them alike")]
    SpacesDiffer {
        /// The environment.
        env_id: usize,
    },
    /// The observation space is not a goal-conditioned environment's.
    #[error(
        "the observation space has no box of f64 named {key:?}: a goal-conditioned environment has \
         observation, achieved_goal and desired_goal"
    )]
    NoGoalSpace {
        /// The missing part.
        key: &'static str,
    },
    /// The actions are too many or too few.
    #[error("{actual} numbers are no {rows} actions of {action_len}: pass one row an environment")]
    ActionCount {
        /// Actions that are needed.
        rows: usize,
        /// Elements of an action.
        action_len: usize,
        /// Numbers given.
        actual: usize,
    },
    /// There is no environment of this id.
    #[error("there is no environment {env_id}: the ids are 0 to {}", num_envs - 1)]
    UnknownEnv {
        /// The id.
        env_id: usize,
        /// The number of environments.
        num_envs: usize,
    },
    /// The environment is at work, or named twice in one call.
    #[error(
        "environment {env_id} is in flight: send to it once, and again when recv() returned it"
    )]
    EnvInFlight {
        /// The environment.
        env_id: usize,
    },
    /// A call for all environments while some are in flight.
    #[error("{count} environments are in flight: recv() them before step() or reset()")]
    InFlight {
        /// How many.
        count: usize,
    },
    /// A batch that would never be complete.
    #[error("a batch of {batch_size} never comes: only {in_flight} environments are in flight")]
    BatchTooLarge {
        /// The batch asked for.
        batch_size: usize,
        /// Environments in flight.
        in_flight: usize,
    },
    /// Seeds or a mask for another number of environments.
    #[error("{actual} elements of {what} for {num_envs} environments: pass one for each")]
    Count {
        /// `seeds` or `mask`.
        what: &'static str,
        /// Elements given.
        actual: usize,
        /// The number of environments.
        num_envs: usize,
    },
    /// A mask that resets nothing.
    #[error("the mask resets no environment: set at least one element")]
    EmptyMask,
    /// The last environment's seed would not fit.
    #[error(
        "the seeds from {first} for {num_envs} environments exceed 64 bits: take a smaller one"
    )]
    SeedTooLarge {
        /// The first environment's seed.
        first: u64,
        /// The number of environments.
        num_envs: usize,
    },
    /// The operating system gave no thread.
    #[error("a worker thread could not be started ({reason}): use fewer threads")]
    Thread {
        /// What the operating system said.
        reason: String,
    },
    /// Threads cannot be pinned here.
    #[error("the threads cannot be pinned to cores on this system: leave pin_threads off")]
    Pinning,
    /// A worker thread has died, and an environment with it.
    #[error("a worker thread has died: make the environments anew")]
    WorkerLost,
}

impl VecEnvError {
    pub(crate) fn from_spawn(error: std::io::Error) -> Self {
        Self::Thread { reason: error.to_string() }
    }
}
