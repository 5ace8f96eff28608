//! Running the runs of a grid, each on its own thread.

use std::ops::ControlFlow;
use std::panic;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use super::description::RunDescription;
use super::envs::MakeEnvs;
use super::error::{GridError, RunsError};
use super::finish::Outcome;
use super::folder::RunFolder;
use super::grid::{Choice, Grid};
use super::grid_folder::GridFolder;
use super::plan::{RunPlan, target_of};
use super::start::{NewRun, Ready};
use super::table::GridEnd;
use crate::learn::{CurveRow, TrainSettings, Trainer};
use crate::workers::OneProcess;

/// A run of a grid.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct GridRun {
    /// The number of its choice of values.
    pub choice: usize,
    /// The assignments in which its choice differs from others, such as `gamma=0.98`.
    pub parts: Vec<String>,
    /// The description of the run.
    pub description: RunDescription,
    /// The settings of the learner.
    pub settings: TrainSettings,
    /// The folder of the run.
    pub path: PathBuf,
}

impl Grid {
    /// Returns the runs of [choices](Self::choices) of the grid in its folder, choice by choice.
    ///
    /// # Errors
    /// As [`env_id`](Self::env_id) and [`preset`](Self::preset).
    pub fn runs(
        &self,
        choices: &[Choice<'_>],
        folder: &GridFolder,
    ) -> Result<Vec<GridRun>, GridError> {
        let (env_id, preset, (steps, target)) = (self.env_id()?, self.preset()?, self.limits()?);
        let mut runs = Vec::new();
        for (number, choice) in choices.iter().enumerate() {
            for &seed in self.seeds() {
                let mut description = RunDescription::new(env_id, preset, seed);
                (description.steps, description.target) = (steps, target);
                description.changes.clone_from(&choice.assignments);
                runs.push(GridRun {
                    choice: number,
                    parts: choice.parts.clone(),
                    description,
                    settings: choice.settings.clone(),
                    path: folder.run(&choice.file_name(), seed),
                });
            }
        }
        Ok(runs)
    }
}

/// When and how a run ended.
#[derive(Debug)]
pub enum GridEvent<'a> {
    /// It had ended before.
    EndedBefore,
    /// It has ended now.
    Ended(&'a Outcome),
    /// It has diverged. Its checkpoints stay: if the grid goes on, it diverges again from there.
    Diverged(&'a RunsError),
}

/// What watches a grid, from the threads of all runs.
pub trait WatchGrid: Sync {
    /// Whether the runs go on. If not, each stops at the end of its cycle.
    fn go_on(&self) -> bool {
        true
    }

    /// A run has taken further steps. In the end, all its steps have been counted.
    fn further_steps(&self, count: u64);

    /// A run has ended, and `num_ended` of all have.
    fn ended(&self, run: &GridRun, num_ended: usize, how: GridEvent<'_>);
}

/// The state that the threads share.
struct Shared<'a, M> {
    tasks: &'a M,
    runs: &'a [GridRun],
    between_checkpoints: Duration,
    watch: &'a dyn WatchGrid,
    /// The number of the next run.
    next: AtomicUsize,
    num_ended: AtomicUsize,
}

/// Runs all runs of a grid to their ends, or until they are stopped, `num_threads` of them at a
/// time. Runs that have checkpoints go on from there. Returns their results in their order, `None`
/// for runs that have not ended. A run that fails does not stop the others.
///
/// # Errors
/// [`GridError::Runs`] if any run failed, after all others have ended.
pub fn run_grid<M: MakeEnvs>(
    tasks: &M,
    runs: &[GridRun],
    num_threads: usize,
    between_checkpoints: Duration,
    watch: &dyn WatchGrid,
) -> Result<Vec<Option<GridEnd>>, GridError> {
    let (next, num_ended) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let shared = Shared { tasks, runs, between_checkpoints, watch, next, num_ended };
    let mut all: Vec<_> = thread::scope(|scope| {
        let num_threads = num_threads.min(runs.len());
        let threads: Vec<_> = (0..num_threads).map(|_| scope.spawn(|| shared.run_some())).collect();
        let ended = threads.into_iter().map(|thread| thread.join());
        ended.flat_map(|some| some.unwrap_or_else(|why| panic::resume_unwind(why))).collect()
    });
    all.sort_by_key(|(number, _)| *number);
    let num_failed = all.iter().filter(|(_, ended)| ended.is_err()).count();
    let ended = all.into_iter().map(|(_, ended)| ended).collect::<Result<_, _>>();
    let num_runs = runs.len();
    ended.map_err(|first| GridError::Runs { num_failed, num_runs, source: Box::new(first) })
}

impl<M: MakeEnvs> Shared<'_, M> {
    /// Runs one run after another until none is left.
    fn run_some(&self) -> Vec<(usize, Result<Option<GridEnd>, GridError>)> {
        let mut all = Vec::new();
        loop {
            let number = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(run) = self.runs.get(number) else { return all };
            all.push((number, if self.watch.go_on() { self.run(run) } else { Ok(None) }));
        }
    }

    /// Begins or continues a run, and runs it to its end.
    fn run(&self, run: &GridRun) -> Result<Option<GridEnd>, GridError> {
        let num_steps = run.description.steps;
        if RunFolder::is_finished(&run.path)? {
            let folder = run.checked(RunFolder::open(&run.path)?)?;
            let end = end_of(&folder)?;
            self.watch.further_steps(num_steps);
            self.ended(run, GridEvent::EndedBefore);
            return Ok(Some(end));
        }
        let Ready { mut trainer, folder } = run.ready(self.tasks)?;
        let plan = RunPlan {
            between_checkpoints: self.between_checkpoints,
            ..RunPlan::of(folder.description())
        };
        let mut shown = 0;
        let mut show = |steps: u64| {
            self.watch.further_steps(steps.saturating_sub(shown));
            shown = shown.max(steps);
        };
        show(trainer.counters().steps);
        let mut watch = |trainer: &Trainer<M::Env>, _: Option<&CurveRow>| {
            show(trainer.counters().steps);
            if self.watch.go_on() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let trained = plan.run(&mut trainer, Some(&folder), &mut watch);
        let end = match trained {
            Err(error) if error.has_diverged() => {
                self.ended(run, GridEvent::Diverged(&error));
                show(num_steps);
                return Ok(Some(GridEnd::Diverged));
            }
            Err(error) => return Err(error.into()),
            Ok(()) if !self.watch.go_on() => return Ok(None),
            Ok(()) => {
                let outcome = plan.finish(self.tasks, &mut trainer, &folder, 1, || true)?;
                self.ended(run, GridEvent::Ended(&outcome));
                end_of(&folder)?
            }
        };
        folder.remove_checkpoints()?;
        show(num_steps);
        Ok(Some(end))
    }

    /// Counts a run that has ended.
    fn ended(&self, run: &GridRun, how: GridEvent<'_>) {
        let num_ended = self.num_ended.fetch_add(1, Ordering::Relaxed) + 1;
        self.watch.ended(run, num_ended, how);
    }
}

impl GridRun {
    /// Begins the run, or continues it from its last checkpoint. If it has neither a checkpoint nor
    /// all of its results, it begins again.
    fn ready<M: MakeEnvs>(&self, tasks: &M) -> Result<Ready<Trainer<M::Env>>, GridError> {
        if RunFolder::has_checkpoint(&self.path)? {
            self.checked(RunFolder::open(&self.path)?)?;
            return Ok(Ready::resume(tasks, &self.path, 1)?);
        }
        let overwrite = RunFolder::is_run(&self.path);
        if overwrite {
            self.checked(RunFolder::open(&self.path)?)?;
        }
        let (description, settings) = (self.description.clone(), self.settings.clone());
        let new = NewRun { description, settings, start: None, overwrite };
        new.begin(tasks, &self.path, 1, Box::new(OneProcess), |_| Ok(()))
    }

    /// Checks that a folder is this run's.
    fn checked(&self, folder: RunFolder) -> Result<RunFolder, GridError> {
        if *folder.description() == self.description {
            return Ok(folder);
        }
        Err(GridError::OtherRun { folder: self.path.clone() })
    }
}

/// Returns how a finished run ended.
fn end_of(folder: &RunFolder) -> Result<GridEnd, GridError> {
    let not_measured = || GridError::NotMeasured { folder: folder.path().to_owned() };
    let success = folder.read_policy()?.header().success.ok_or_else(not_measured)?;
    let curve = folder.read_curve()?;
    let reached = target_of(folder.description().target).first_reached(&curve).copied();
    Ok(GridEnd::Finished { success_rate: success.rate.value, reached })
}
