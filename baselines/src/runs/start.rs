//! Beginning a run in a folder, and resuming it.

use std::fmt;
use std::path::Path;

use fetch_env::SnapshotEnv;

use super::description::RunDescription;
use super::envs::{MakeEnvs, RunEnv, maker};
use super::error::RunsError;
use super::folder::RunFolder;
use crate::learn::{LearnEnv, Resumed, SaveLearner, TrainSettings, Trainer, check_same};
use crate::trained::TrainedPolicy;
use crate::workers::{OneProcess, UnreadableMessage, Workers, gather_values};

/// A run that is ready to go on.
#[non_exhaustive]
pub struct Ready<L> {
    /// What trains: a [`Trainer`], or a [`Student`](super::Student).
    pub trainer: L,
    /// Where it writes.
    pub folder: RunFolder,
}

impl<L> fmt::Debug for Ready<L> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ready").field("folder", &self.folder).finish_non_exhaustive()
    }
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
    pub fn begin<M: MakeEnvs, X: From<RunsError>>(
        self,
        tasks: &M,
        path: impl AsRef<Path>,
        num_threads: usize,
        workers: Box<dyn Workers>,
        prepare: impl FnOnce(&mut Trainer<M::Env>) -> Result<(), X>,
    ) -> Result<Ready<Trainer<M::Env>>, X> {
        let path = path.as_ref();
        let mut trainer = self.trainer(tasks, num_threads, workers)?;
        if trainer.workers().rank() == 0 {
            RunFolder::check_free(path, self.overwrite).map_err(RunsError::from)?;
        }
        prepare(&mut trainer)?;
        Ok(self.begin_with(tasks.task(), trainer, path)?)
    }

    /// Prepares the training of the run, without a folder.
    ///
    /// # Errors
    /// [`RunsError`] if the run cannot be set up.
    pub fn trainer<M: MakeEnvs>(
        &self,
        tasks: &M,
        num_threads: usize,
        workers: Box<dyn Workers>,
    ) -> Result<Trainer<M::Env>, RunsError> {
        let make = maker(tasks, self.description.config());
        let (settings, seed) = (self.settings.clone(), self.description.seed);
        let mut trainer = Trainer::with_workers(make, settings, seed, num_threads, workers)?;
        if let Some(policy) = &self.start {
            trainer.start_from(policy)?;
        }
        Ok(trainer)
    }

    /// Begins the run of a trainer in a folder.
    fn begin_with<E: LearnEnv + SnapshotEnv>(
        self,
        task: Option<&str>,
        mut trainer: Trainer<E>,
        path: &Path,
    ) -> Result<Ready<Trainer<E>>, RunsError> {
        let (start, task) = (self.start_name(), task.map(str::to_owned));
        let description = RunDescription { start, task, ..self.description };
        let folder = create(path, description, self.overwrite, None, &mut trainer)?;
        Ok(Ready { trainer, folder })
    }

    /// Describes the policy that the run starts from.
    fn start_name(&self) -> Option<String> {
        self.start.as_ref().map(policy_name)
    }

    /// Continues the run in a folder from its last checkpoint, or begins this one if there is none.
    /// The run in the folder keeps its own steps and target, and does not need the policy that it
    /// started from; everything else must be the same.
    ///
    /// # Errors
    /// Those of [`begin`](Self::begin) and [`Ready::resume`], and
    /// [`CheckpointError::OtherSettings`](crate::learn::CheckpointError::OtherSettings) if the run in
    /// the folder has another environment, seed or settings.
    pub fn resume_or_begin<M: MakeEnvs>(
        self,
        tasks: &M,
        path: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Ready<Trainer<M::Env>>, RunsError> {
        let path = path.as_ref();
        if !RunFolder::has_checkpoint(path)? {
            return self.begin(tasks, path, num_threads, Box::new(OneProcess), |_| Ok(()));
        }
        let start = self.start_name();
        let Self { description, settings, .. } = self;
        let ready = Ready::resume(tasks, path, num_threads)?;
        let found = ready.folder.description();
        found.check_environment(&description, path)?;
        if start.is_some() && start != found.start {
            return Err(RunsError::other(path, "another policy to start from"));
        }
        check_same(&ready.trainer, &settings, description.seed, path)?;
        Ok(ready)
    }
}

impl<E: RunEnv> Ready<Trainer<E>> {
    /// Continues the run in a folder from its last checkpoint, in one process.
    ///
    /// # Errors
    /// As [`resume_with_workers`](Self::resume_with_workers).
    pub fn resume(
        tasks: &impl MakeEnvs<Env = E>,
        path: impl AsRef<Path>,
        num_threads: usize,
    ) -> Result<Self, RunsError> {
        let workers = Box::new(OneProcess);
        Self::resume_with_workers(tasks, path, num_threads, workers).map(|(ready, _)| ready)
    }

    /// Continues the run in a folder from its last checkpoint, shared by several processes, of which
    /// the first reads the folder. Returns whether it continues exactly.
    ///
    /// # Errors
    /// [`RunsError`] if there is no run to resume, another process writes there, or the checkpoint
    /// is damaged, and [`RunsError::OtherTask`] if `tasks` makes environments of another task.
    pub fn resume_with_workers(
        tasks: &impl MakeEnvs<Env = E>,
        path: impl AsRef<Path>,
        num_threads: usize,
        workers: Box<dyn Workers>,
    ) -> Result<(Self, Resumed), RunsError> {
        Self::resume_in(tasks, path.as_ref(), num_threads, workers)
    }

    fn resume_in(
        tasks: &impl MakeEnvs<Env = E>,
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
        let description = folder.description();
        description.check_task(tasks, path)?;
        if description.teacher.is_some() {
            return Err(RunsError::HasTeacher { folder: path.to_owned() });
        }
        let make = maker(tasks, description.config());
        let (trainer, resumed) = Trainer::resume_with_workers(make, path, num_threads, workers)?;
        Ok((Self { trainer, folder }, resumed))
    }
}

/// Begins a run in a folder: its description, its teacher if it has one, and its first checkpoint.
pub(super) fn create(
    path: &Path,
    description: RunDescription,
    overwrite: bool,
    teacher: Option<&TrainedPolicy>,
    learner: &mut dyn SaveLearner,
) -> Result<RunFolder, RunsError> {
    let folder = if learner.workers().rank() == 0 {
        RunFolder::create(path, description, overwrite)?
    } else {
        RunFolder::of_other(path, description)
    };
    teacher.map_or(Ok(()), |teacher| folder.write_teacher(teacher))?;
    learner.save(path)?;
    Ok(folder)
}

/// Describes a policy.
pub(super) fn policy_name(policy: &TrainedPolicy) -> String {
    let header = policy.header();
    let (env_id, seed, steps) = (&header.env_id, header.seed, header.steps);
    format!("{env_id}, seed {seed}, {steps} steps")
}
