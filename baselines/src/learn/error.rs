//! The errors of training and of checkpoints.

use std::error::Error;
use std::io;
use std::path::PathBuf;

use fetch_env::{EnvError, vec_env::VecEnvError};
use her_relabel::{AddError, ConfigError, NormalizerError, SampleError};

use crate::collector::CollectorError;
use crate::evaluate::EvaluationError;
use crate::network::PictureShapeError;
use crate::trained::TrainedPolicyError;
use crate::workers::{Disagreement, UnreadableMessage};

/// Error returned by a [`Trainer`](super::Trainer).
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum TrainError {
    /// A setting is out of its range.
    #[error("{name} is {value}: {expected}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it must be.
        expected: &'static str,
    },
    /// A setting would have no effect, because the algorithm learns only from the steps that its
    /// actor has just taken.
    #[error("{algorithm} does not use {name}, which is {value}: leave it at {expected}")]
    Unused {
        /// The setting.
        name: String,
        /// Its value.
        value: String,
        /// The value that it must have.
        expected: String,
        /// The algorithm.
        algorithm: String,
    },
    /// An algorithm that learns only from the steps that its actor has just taken cannot learn from
    /// anything else.
    #[error(
        "{algorithm} learns from the steps of its own actor alone: choose another algorithm to learn \
         from demonstrations"
    )]
    OnPolicy {
        /// The algorithm.
        algorithm: String,
    },
    /// A run cannot start from a policy.
    #[error(
        "the run cannot start from the policy, because {reason}: change the run's settings, or start \
         from another policy"
    )]
    Start {
        /// What does not fit.
        reason: String,
    },
    /// The actions of the environment are not from -1 to 1.
    #[error("the actions of the environment are not from -1 to 1: wrap it with RescaleAction")]
    ActionSpace,
    /// A student cannot see these pictures.
    #[error("pictures for a student are of one view and one frame, with the channels last")]
    Frames,
    /// An actor that sees pictures has no critic to learn from.
    #[error(
        "an actor that sees pictures learns from a critic of actions, and {algorithm} shows none: \
         choose ddpg, or give your algorithm `value_slopes`"
    )]
    NoCritic {
        /// The name of the algorithm.
        algorithm: String,
    },
    /// Pictures show the goal's marker, and hindsight changes goals.
    #[error(
        "learning in hindsight changes goals, and not the pictures that show them: hide the goal's \
         marker, or learn from a teacher"
    )]
    GoalShown,
    /// There is no network for these pictures.
    #[error(transparent)]
    Picture(#[from] PictureShapeError),
    /// An environment could not be made.
    #[error("an environment could not be made")]
    Make(#[source] EnvError),
    /// Your algorithm could not be built.
    #[error("the algorithm could not be built")]
    Algorithm(#[source] Box<dyn Error + Send + Sync>),
    /// The state of your algorithm cannot be saved.
    #[error("the state of the algorithm {algorithm} cannot be saved: {reason}")]
    State {
        /// The name of the algorithm.
        algorithm: String,
        /// What is wrong.
        reason: String,
    },
    /// The environments could not be stepped together.
    #[error(transparent)]
    Vec(#[from] VecEnvError),
    /// The buffer could not be made.
    #[error(transparent)]
    Buffer(#[from] ConfigError),
    /// Demonstrations do not fit the environments.
    #[error("the demonstrations do not fit the environments")]
    Demonstrations(#[from] AddError),
    /// Observations could not be normalized.
    #[error(transparent)]
    Normalize(#[from] NormalizerError),
    /// There is nothing to learn from.
    #[error(
        "the buffer has no finished episode to draw: add demonstrations with add_demonstrations, \
         or collect with cycle or run"
    )]
    NothingToDraw,
    /// The run failed.
    #[error("the run failed after {steps} steps{}", resume_hint(.checkpoint.as_ref()))]
    Run {
        /// The number of steps recorded before.
        steps: u64,
        /// The last checkpoint, from which the run can be resumed.
        checkpoint: Option<PathBuf>,
        /// What failed.
        source: Box<RunError>,
    },
    /// The training has diverged, so there is no greedy policy.
    #[error(transparent)]
    Policy(#[from] TrainedPolicyError),
    /// An evaluation failed.
    #[error(transparent)]
    Evaluate(#[from] EvaluationError),
    /// The trainer was made before a fork: its threads exist only in the parent process.
    #[error(
        "this process was forked, and the trainer's threads are not in it: make the trainer here"
    )]
    Forked,
    /// The threads could not be started.
    #[error("the threads could not be started")]
    Threads(#[source] rayon::ThreadPoolBuildError),
    /// The processes of a run do not agree.
    #[error(transparent)]
    Disagreement(#[from] Disagreement),
    /// Another process sent something that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] UnreadableMessage),
}

debug_as_display!(TrainError);

/// What ended a run: the source of [`TrainError::Run`].
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// Steps could not be collected.
    #[error(transparent)]
    Collect(#[from] CollectorError),
    /// A batch could not be drawn.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// Observations could not be normalized.
    #[error(transparent)]
    Normalize(#[from] NormalizerError),
    /// A drawn reward is outside the bounds that the reward function gives.
    #[error(
        "a reward, or the sum of a window's rewards, is {value:?}, outside of {low} to {high}, which \
         follows from GoalReward::bounds: widen the bounds, or correct the reward"
    )]
    RewardOutside {
        /// The first such reward, or sum of a window's rewards.
        value: f64,
        /// The lowest that [`GoalReward::bounds`](goal_reward::GoalReward::bounds) allows.
        low: f64,
        /// The highest that they allow.
        high: f64,
    },
    /// All environments failed in a whole cycle.
    #[error(
        "every environment failed, environment {env_index} first: check it with fetch_env::check"
    )]
    AllFailed {
        /// The environment that failed first.
        env_index: usize,
        /// Its error.
        source: EnvError,
    },
    /// An environment failed while a student was distilled.
    #[error("environment {env_index} failed: check it with fetch_env::check")]
    Environment {
        /// The environment, counted from 0.
        env_index: usize,
        /// Its error.
        source: EnvError,
    },
    /// A teacher does not know what to do in a state.
    #[error("the teacher has no finite action in environment {env_index}: choose another teacher")]
    Teacher {
        /// The environment, counted from 0.
        env_index: usize,
    },
    /// An environment took no step in a whole cycle, because it could not be reset.
    #[error(
        "environment {env_index} could not be reset in a whole cycle: check it with \
         fetch_env::check"
    )]
    Stuck {
        /// The environment.
        env_index: usize,
        /// Its last error.
        source: EnvError,
    },
    /// An environment returned a number that is not finite in an evaluation.
    #[error(
        "environment {env_index} returned {what} that is not finite in the evaluation: check it \
         with fetch_env::check"
    )]
    EvaluationNotFinite {
        /// The environment, counted from 0.
        env_index: usize,
        /// What is not finite.
        what: &'static str,
    },
    /// A loss is not a finite number.
    #[error(
        "the losses diverged in update {update} (critic {critic}, actor {actor}): choose smaller \
         learning rates"
    )]
    Diverged {
        /// The update, counted from 1.
        update: u64,
        /// The critic's loss.
        critic: f32,
        /// The actor's loss.
        actor: f32,
    },
}

debug_as_display!(RunError);

fn resume_hint(checkpoint: Option<&PathBuf>) -> String {
    checkpoint
        .map_or_else(String::new, |path| format!("; the last checkpoint is {}", path.display()))
}

/// Error returned when a checkpoint cannot be saved or resumed.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The checkpoint cannot be written.
    #[error("the checkpoint {} cannot be written; earlier checkpoints are intact", path.display())]
    Write {
        /// The checkpoint.
        path: PathBuf,
        /// The error of the file system.
        source: io::Error,
    },
    /// No run could be resumed from the checkpoint, so it is not written.
    #[error(
        "the checkpoint {} is not written, because no run could be resumed from it: {reason}; \
         earlier checkpoints are intact",
        path.display()
    )]
    Unreadable {
        /// The checkpoint.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The checkpoint cannot be read.
    #[error("{} cannot be read", path.display())]
    Read {
        /// The checkpoint, or its folder.
        path: PathBuf,
        /// The error of the file system.
        source: io::Error,
    },
    /// The folder has no checkpoint.
    #[error("there is no checkpoint in {}", folder.display())]
    None {
        /// The folder.
        folder: PathBuf,
    },
    /// The checkpoint is damaged.
    #[error(
        "the checkpoint {} is damaged: {reason}{}",
        path.display(),
        remove_hint(.before.as_ref())
    )]
    Damaged {
        /// The checkpoint.
        path: PathBuf,
        /// What is wrong.
        reason: String,
        /// The checkpoint before it.
        before: Option<PathBuf>,
    },
    /// The checkpoint belongs to a different environment.
    #[error("the checkpoint {} belongs to a different environment: {reason}", path.display())]
    Foreign {
        /// The checkpoint.
        path: PathBuf,
        /// What differs.
        reason: String,
    },
    /// The policy of the checkpoint sees something else.
    #[error(
        "the policy in the checkpoint {} sees {sees}: resume it with the same camera, size and fields, \
         or begin another run",
        path.display()
    )]
    OtherSight {
        /// The checkpoint.
        path: PathBuf,
        /// What its policy sees.
        sees: String,
    },
    /// A file in the place of a checkpoint does not belong to this run.
    #[error(
        "{} is not a checkpoint of this run, so nothing is written: choose another folder",
        path.display()
    )]
    OtherRun {
        /// The file.
        path: PathBuf,
    },
    /// The run in a folder has other settings, or another seed.
    #[error("the run in {} has {what}: pass the same, or choose another folder", folder.display())]
    OtherSettings {
        /// The folder.
        folder: PathBuf,
        /// What it has.
        what: String,
    },
    /// The state of the environments cannot be taken or restored.
    #[error("the environments do not fit the checkpoint")]
    Envs(#[source] VecEnvError),
    /// The run cannot be set up.
    #[error(transparent)]
    Train(#[from] TrainError),
}

debug_as_display!(CheckpointError);

fn remove_hint(before: Option<&PathBuf>) -> String {
    before.map_or_else(String::new, |path| format!("; remove it to resume from {}", path.display()))
}
