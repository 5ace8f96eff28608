//! Errors of runs with the flags that help.

use anyhow::anyhow;
use baselines::{
    learn::TrainError,
    runs::{FolderError, RunsError},
};

use crate::output::usage;

/// Returns an error with the flags that help. That of a wrong setting, which not every environment
/// can have, is one of wrong usage.
pub fn in_flags(error: anyhow::Error) -> anyhow::Error {
    match error.downcast_ref() {
        Some(RunsError::Train(
            TrainError::Setting { .. }
            | TrainError::Start { .. }
            | TrainError::Picture(_)
            | TrainError::NoCritic { .. },
        )) => usage(error),
        Some(RunsError::HasTeacher { folder }) => {
            usage(format_args!("the run in {} has a teacher: leave out --mpi", folder.display()))
        }
        Some(RunsError::Folder(of_folder)) => match of_folder {
            FolderError::HasRun { folder, has_checkpoint } => anyhow!(
                "{} has a run: {}replace it with --overwrite, or choose another folder with --out",
                folder.display(),
                if *has_checkpoint { "continue it with --resume, " } else { "" }
            ),
            FolderError::NoCheckpoint { folder } => anyhow!(
                "{} has no checkpoint: start the run again, without --resume",
                folder.display()
            ),
            _ => error,
        },
        _ => error,
    }
}
