//! The errors of runs, of their folders and of grids.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

use fetch_env::MakeError;

use crate::evaluate::EvaluationError;
use crate::learn::{CheckpointError, RunError, TrainError};
#[cfg(feature = "page")]
use crate::page::PageError;
use crate::statistics::StatisticsError;
use crate::trained::TrainedPolicyError;
use crate::workers::UnreadableMessage;

/// Error returned for a folder in which a run cannot begin or go on, or for one of its files.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// A file or a folder cannot be made, read, written, removed or locked.
    #[error("cannot {action} {}", path.display())]
    File {
        /// What cannot be done.
        action: &'static str,
        /// The file or the folder.
        path: PathBuf,
        /// The error of the file system.
        source: io::Error,
    },
    /// Another process writes in the folder.
    #[error(
        "cannot lock {}: {holder} is using the folder: wait until it has ended, or choose another \
         folder",
        lock.display()
    )]
    InUse {
        /// The lock.
        lock: PathBuf,
        /// The process, and its host.
        holder: String,
    },
    /// The files of a run are written where the folder was opened to read it, or by a process that
    /// is not the first.
    #[error("another process writes the files of the run in {}", folder.display())]
    ReadOnly {
        /// The folder.
        folder: PathBuf,
    },
    /// The folder has no description of a run.
    #[error("{} is not the folder of a run: choose one that has a run.json", folder.display())]
    NotARun {
        /// The folder.
        folder: PathBuf,
        /// Why the description cannot be read.
        source: io::Error,
    },
    /// A description is not one that this crate writes.
    #[error("{} is damaged: restore it, or choose another folder", path.display())]
    Damaged {
        /// The description.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// A file of curves is not one that this crate writes.
    #[error("{} is not a curve: restore the file, or remove it", path.display())]
    Csv {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: csv::Error,
    },
    /// A new run would replace the run in the folder.
    #[error(
        "{} has a run: {}overwrite it, or choose another folder",
        folder.display(),
        if *has_checkpoint { "resume it, " } else { "" }
    )]
    HasRun {
        /// The folder.
        folder: PathBuf,
        /// Whether the run can be resumed.
        has_checkpoint: bool,
    },
    /// A file has the name of one that a run or a grid writes.
    #[error(
        "{} exists, but there is no {description} beside it, so it may be of something else: \
         choose another folder",
        path.display()
    )]
    Taken {
        /// The file.
        path: PathBuf,
        /// The name of the description.
        description: &'static str,
    },
    /// Something else is in a folder whose run was to be overwritten.
    #[error(
        "{} is not the folder of a run, and only runs are overwritten: do not overwrite, or choose \
         another folder",
        folder.display()
    )]
    NotOverwritten {
        /// The folder.
        folder: PathBuf,
    },
    /// There is nothing to resume from.
    #[error("{} has no checkpoint: start the run again", folder.display())]
    NoCheckpoint {
        /// The folder.
        folder: PathBuf,
    },
    /// The policy of a run cannot be read or written.
    #[error(transparent)]
    Policy(#[from] TrainedPolicyError),
}

debug_as_display!(FolderError);

impl FolderError {
    /// Returns a function that says what could not be done with a file.
    pub(super) fn file(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::File { action, path: path.to_owned(), source }
    }
}

/// Error returned for a run that cannot begin, go on or end.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum RunsError {
    /// The folder cannot be used, or one of its files.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The training failed.
    #[error(transparent)]
    Train(#[from] TrainError),
    /// A checkpoint cannot be saved or resumed.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The run in a folder has another task than the environments.
    #[error(
        "the run in {} has the task {task}: continue it where environments of this task are made, or \
         choose another folder",
        folder.display()
    )]
    OtherTask {
        /// The folder.
        folder: PathBuf,
        /// The task's name, or the environment's if the task is built in.
        task: String,
    },
    /// The run in a folder has a teacher.
    #[error(
        "the run in {} has a teacher: continue it with Ready::resume_student, in one process",
        folder.display()
    )]
    HasTeacher {
        /// The folder.
        folder: PathBuf,
    },
    /// An environment cannot be made.
    #[error(transparent)]
    Make(#[from] MakeError),
    /// There is no policy, because the training has diverged.
    #[error(transparent)]
    Policy(#[from] TrainedPolicyError),
    /// The final evaluation failed.
    #[error(transparent)]
    Evaluate(#[from] EvaluationError),
    /// The page cannot be made.
    #[cfg(feature = "page")]
    #[error(transparent)]
    Page(#[from] PageError),
    /// Another process sent something that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] UnreadableMessage),
}

debug_as_display!(RunsError);

impl RunsError {
    /// The error of a folder with the run of something else.
    pub(super) fn other(folder: &Path, what: &str) -> Self {
        let (folder, what) = (folder.to_owned(), what.to_owned());
        CheckpointError::OtherSettings { folder, what }.into()
    }

    /// Whether the run ended because its losses or its weights are no longer finite.
    #[must_use]
    pub fn has_diverged(&self) -> bool {
        match self {
            Self::Train(TrainError::Policy(_)) => true,
            Self::Train(TrainError::Run { source, .. }) => {
                matches!(**source, RunError::Diverged { .. })
            }
            _ => false,
        }
    }
}

/// Error returned for a teacher that there is not.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum TeacherError {
    /// The planner cannot say what to do in the states to which a student leads.
    #[error(
        "the planner is no teacher, because it plans whole episodes: it would have to plan anew from \
         each state to which a student leads; choose scripted, trained or the file of a policy"
    )]
    Planned,
    /// There is no such teacher.
    #[error("there is no teacher {name}: choose scripted, trained or the file of a policy")]
    Unknown {
        /// The name.
        name: String,
    },
    /// The policy sees pictures.
    #[error("the policy {name} sees pictures: choose a teacher that sees the state")]
    Pixels {
        /// The file.
        name: String,
    },
    /// The policy cannot be read.
    #[error(transparent)]
    Policy(#[from] TrainedPolicyError),
}

debug_as_display!(TeacherError);

/// Error returned for a grid that cannot be run.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// The text is not the JSON of a grid.
    #[error("the file is not a grid")]
    Json(#[from] serde_json::Error),
    /// There is no such key.
    #[error("there is no key {key}; did you mean {nearest}?")]
    UnknownKey {
        /// The key.
        key: String,
        /// The most similar one.
        nearest: &'static str,
    },
    /// A key has a wrong value.
    #[error("{key}: {reason}")]
    Value {
        /// The key.
        key: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// A list is empty.
    #[error("{key} is empty: give it at least one value, or leave it out")]
    Empty {
        /// The key of the list.
        key: String,
    },
    /// Two runs would be the same.
    #[error("{what} appears twice: leave one out")]
    Repeated {
        /// What appears twice.
        what: String,
    },
    /// There are too many runs.
    #[error("the grid has {num_runs} runs: choose at most {most}, or several grids")]
    TooMany {
        /// The number of runs.
        num_runs: usize,
        /// The largest number.
        most: usize,
    },
    /// The folder has another grid.
    #[error(
        "{} has the runs of another grid, which differs in {difference}: choose another folder, or \
         undo the change to the file",
        folder.display()
    )]
    Changed {
        /// The folder.
        folder: PathBuf,
        /// The first place that differs, such as `grid.seeds`.
        difference: String,
    },
    /// The description in the folder is not one of a grid.
    #[error("{} does not describe a grid: restore it, or choose another folder", path.display())]
    Damaged {
        /// The description.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// A run's folder has a different run.
    #[error("{} has a different run: choose another folder", folder.display())]
    OtherRun {
        /// The folder.
        folder: PathBuf,
    },
    /// The folder cannot be used, or one of its files.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A run failed.
    #[error(transparent)]
    Run(#[from] RunsError),
    /// A finished run has no success rate.
    #[error("the policy of the run in {} has no success rate: remove the folder", folder.display())]
    NotMeasured {
        /// The folder.
        folder: PathBuf,
    },
    /// Some runs failed.
    #[error("{num_failed} of {num_runs} runs failed, and the grid tries them again; first error")]
    Runs {
        /// The number of runs that failed.
        num_failed: usize,
        /// The number of all runs.
        num_runs: usize,
        /// The error of the first of them.
        source: Box<Self>,
    },
    /// A row of the table has no estimate.
    #[error("the choice {choice} has no result")]
    Estimate {
        /// The choice of values.
        choice: String,
        /// Why there is none.
        source: StatisticsError,
    },
}

debug_as_display!(GridError);

impl GridError {
    pub(super) fn value(key: &'static str, reason: &impl Display) -> Self {
        Self::Value { key, reason: reason.to_string() }
    }
}
