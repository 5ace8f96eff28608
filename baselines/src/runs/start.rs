//! Beginning a run in a folder, and resuming it.

use std::path::Path;

use fetch_env::{EnvError, FetchConfig, MujocoEnv, make};

use super::description::RunDescription;
use super::error::RunsError;
use super::folder::RunFolder;
use crate::learn::{Resumed, TrainSettings, Trainer};
use crate::workers::{OneProcess, UnreadableMessage, Workers, gather_values};

/// A run that is ready to go on.
#[derive(Debug)]
#[non_exhaustive]
pub struct Ready {
    /// What trains.
    pub trainer: Trainer<MujocoEnv>,
    /// Where it writes.
    pub folder: RunFolder,
}

/// A run that begins: what its folder says, and how it learns.
#[derive(Clone, Debug)]
pub struct NewRun {
    /// The description of the run.
    pub description: RunDescription,
    /// The settings of the learner.
    pub settings: TrainSettings,
    /// Whether it replaces the run in its folder.
    pub overwrite: bool,
}

impl NewRun {
    /// Begins the run in a folder, and saves its first checkpoint. All processes of `workers` share
    /// it, and the first one writes. `prepare` gets the trainer before anything is written or
    /// removed, and may add demonstrations.
    ///
    /// # Errors
    /// Those of `prepare`, and [`RunsError`] if the run cannot be set up, or its folder is not
    /// [free](RunFolder::check_free).
    pub fn begin<X: From<RunsError>>(
        self,
        path: impl AsRef<Path>,
        num_threads: usize,
        workers: Box<dyn Workers>,
        prepare: impl FnOnce(&mut Trainer<MujocoEnv>) -> Result<(), X>,
    ) -> Result<Ready, X> {
        let Self { description, settings, overwrite } = self;
        let path = path.as_ref();
        let make = maker(description.config());
        let mut trainer =
            Trainer::with_workers(make, settings, description.seed, num_threads, workers)
                .map_err(RunsError::from)?;
        let is_first = trainer.workers().rank() == 0;
        if is_first {
            RunFolder::check_free(path, overwrite).map_err(RunsError::from)?;
        }
        prepare(&mut trainer)?;
        let folder = if is_first {
            RunFolder::create(path, description, overwrite).map_err(RunsError::from)?
        } else {
            RunFolder::of_other(path, description)
        };
        trainer.save(path).map_err(RunsError::from)?;
        Ok(Ready { trainer, folder })
    }
}

impl Ready {
    /// Continues the run in a folder from its last checkpoint, in one process.
    ///
    /// # Errors
    /// As [`resume_with_workers`](Self::resume_with_workers).
    pub fn resume(path: impl AsRef<Path>, num_threads: usize) -> Result<Self, RunsError> {
        Self::resume_with_workers(path, num_threads, Box::new(OneProcess)).map(|(ready, _)| ready)
    }

    /// Continues the run in a folder from its last checkpoint, shared by several processes, of which
    /// the first reads the folder. Returns whether it continues exactly.
    ///
    /// # Errors
    /// [`RunsError`] if there is no run to resume, another process writes there, or the checkpoint
    /// is damaged.
    pub fn resume_with_workers(
        path: impl AsRef<Path>,
        num_threads: usize,
        mut workers: Box<dyn Workers>,
    ) -> Result<(Self, Resumed), RunsError> {
        let path = path.as_ref();
        let folder = if workers.rank() == 0 { Some(RunFolder::resume(path)?) } else { None };
        let own = folder.as_ref().map(RunFolder::description);
        let first = gather_values(&mut *workers, &own.cloned())?.swap_remove(0);
        let folder = match (folder, first) {
            (Some(folder), _) => folder,
            (None, Some(description)) => RunFolder::of_other(path, description),
            (None, None) => {
                let reason = "it has no description of the run".to_owned();
                return Err(UnreadableMessage { rank: 0, reason }.into());
            }
        };
        let make = maker(folder.description().config());
        let (trainer, resumed) = Trainer::resume_with_workers(make, path, num_threads, workers)?;
        Ok((Self { trainer, folder }, resumed))
    }
}

/// Returns a function that makes the environments of a run.
fn maker(config: FetchConfig) -> impl Fn() -> Result<MujocoEnv, EnvError> {
    move || Ok(make(config.clone())?)
}
