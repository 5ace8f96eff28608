//! Beginning a run in a folder, and resuming it.

use std::path::Path;

use fetch_env::{EnvError, FetchConfig, MujocoEnv, make};

use super::description::RunDescription;
use super::error::RunsError;
use super::folder::RunFolder;
use crate::learn::{CheckpointError, Resumed, TrainSettings, Trainer};
use crate::trained::TrainedPolicy;
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
    /// The policy that it [starts from](Trainer::start_from).
    pub start: Option<TrainedPolicy>,
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
        let path = path.as_ref();
        let mut trainer = self.trainer(num_threads, workers)?;
        if trainer.workers().rank() == 0 {
            RunFolder::check_free(path, self.overwrite).map_err(RunsError::from)?;
        }
        prepare(&mut trainer)?;
        Ok(self.begin_with(trainer, path)?)
    }

    /// Prepares the training of the run, without a folder.
    ///
    /// # Errors
    /// [`RunsError`] if the run cannot be set up.
    pub fn trainer(
        &self,
        num_threads: usize,
        workers: Box<dyn Workers>,
    ) -> Result<Trainer<MujocoEnv>, RunsError> {
        let make = maker(self.description.config());
        let (settings, seed) = (self.settings.clone(), self.description.seed);
        let mut trainer = Trainer::with_workers(make, settings, seed, num_threads, workers)?;
        if let Some(policy) = &self.start {
            trainer.start_from(policy)?;
        }
        Ok(trainer)
    }

    /// Begins the run of a trainer in a folder.
    fn begin_with(self, mut trainer: Trainer<MujocoEnv>, path: &Path) -> Result<Ready, RunsError> {
        let description = RunDescription { start: self.start_name(), ..self.description };
        let folder = if trainer.workers().rank() == 0 {
            RunFolder::create(path, description, self.overwrite)?
        } else {
            RunFolder::of_other(path, description)
        };
        trainer.save(path)?;
        Ok(Ready { trainer, folder })
    }

    /// Describes the policy that the run starts from.
    fn start_name(&self) -> Option<String> {
        let header = self.start.as_ref()?.header();
        let (env_id, seed, steps) = (&header.env_id, header.seed, header.steps);
        Some(format!("{env_id}, seed {seed}, {steps} steps"))
    }

    /// Continues the run in a folder from its last checkpoint, or begins this one if there is none.
    /// The run in the folder keeps its own steps and target, and does not need the policy that it
    /// started from; everything else must be the same.
    ///
    /// # Errors
    /// Those of [`begin`](Self::begin) and [`Ready::resume`], and
    /// [`CheckpointError::OtherSettings`] if the run in the folder has another environment, seed or
    /// settings.
    pub fn resume_or_begin(
        self,
        path: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Ready, RunsError> {
        let path = path.as_ref();
        if !RunFolder::has_checkpoint(path)? {
            return self.begin(path, num_threads, Box::new(OneProcess), |_| Ok(()));
        }
        let start = self.start_name();
        let Self { description, settings, .. } = self;
        let ready = Ready::resume(path, num_threads)?;
        let found = ready.folder.description();
        if found.config() != description.config() {
            let what = match found.env_id == description.env_id {
                true => "other settings of the environment".to_owned(),
                false => format!("the environment {}", found.env_id),
            };
            return Err(CheckpointError::OtherSettings { folder: path.to_owned(), what }.into());
        }
        if start.is_some() && start != found.start {
            let what = "another policy to start from".to_owned();
            return Err(CheckpointError::OtherSettings { folder: path.to_owned(), what }.into());
        }
        ready.trainer.check_same(&settings, description.seed, path)?;
        Ok(ready)
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
        workers: Box<dyn Workers>,
    ) -> Result<(Self, Resumed), RunsError> {
        Self::resume_in(path.as_ref(), num_threads, workers)
    }

    fn resume_in(
        path: &Path,
        num_threads: usize,
        mut workers: Box<dyn Workers>,
    ) -> Result<(Self, Resumed), RunsError> {
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
