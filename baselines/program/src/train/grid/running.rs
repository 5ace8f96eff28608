//! Running the runs of a grid, each on its own thread.

use std::{
    panic,
    path::PathBuf,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
};

use anyhow::{Context, ensure};
use baselines::{
    learn::{RunError, Target, TrainError, TrainSettings, Trainer},
    workers::OneProcess,
};
use indicatif::ProgressBar;

use super::super::{
    Args, Ready,
    curve_line::{CurveLine, reached},
    files::{Run, RunFiles},
    finish::{self, Course, Length},
    make, start,
};
use crate::shared::{progress, signals::Signals};

/// A run of a grid.
pub struct Planned {
    /// The number of its choice of values.
    pub choice: usize,
    pub settings: TrainSettings,
    pub args: Args,
    pub folder: PathBuf,
    /// The choice, at the beginning of each line about the run.
    pub name: String,
}

/// How a run ended, if no signal has stopped it.
pub enum Ended {
    Finished {
        /// The success rate of the final evaluation.
        success_rate: f64,
        /// The second of two evaluations in a row that reached the target.
        reached: Option<CurveLine>,
    },
    /// Its losses or its weights are not finite.
    Diverged,
}

/// The state that the threads share.
struct Shared<'a> {
    planned: &'a [Planned],
    /// The number of the next run.
    next: AtomicUsize,
    num_ended: AtomicUsize,
    bar: ProgressBar,
    signals: &'a Signals,
}

/// Runs all runs to their ends, or to the end of the cycle in which this process receives a signal.
/// Returns their results in the order of the plan, `None` for runs that have not ended. A run that
/// fails does not stop the others. `num_steps` is the number of steps of a run.
pub fn run_all(
    planned: &[Planned],
    num_steps: u64,
    num_threads: usize,
    signals: &Signals,
) -> anyhow::Result<Vec<Option<Ended>>> {
    let num_steps = num_steps.saturating_mul(planned.len() as u64);
    let bar = progress::bar(usize::try_from(num_steps)?, "training");
    bar.set_message(format!("0 of {} runs", planned.len()));
    let (next, num_ended) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let shared = Shared { planned, next, num_ended, bar, signals };
    let mut all: Vec<_> = thread::scope(|scope| {
        let num_threads = num_threads.min(planned.len());
        let threads: Vec<_> = (0..num_threads).map(|_| scope.spawn(|| shared.run_some())).collect();
        let ended = threads.into_iter().map(|thread| thread.join());
        ended.flat_map(|some| some.unwrap_or_else(|why| panic::resume_unwind(why))).collect()
    });
    shared.bar.finish_and_clear();
    all.sort_by_key(|(number, _)| *number);
    let num_failed = all.iter().filter(|(_, ended)| ended.is_err()).count();
    let ended = all.into_iter().map(|(_, ended)| ended).collect::<anyhow::Result<_>>();
    ended.map_err(|first| {
        first.context(format!(
            "{num_failed} of {} runs failed, and the same command tries them again; first error",
            planned.len()
        ))
    })
}

impl Shared<'_> {
    /// Runs one run after another until none is left.
    fn run_some(&self) -> Vec<(usize, anyhow::Result<Option<Ended>>)> {
        let mut all = Vec::new();
        loop {
            let number = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(planned) = self.planned.get(number) else { return all };
            let is_stopped = self.signals.received() != 0;
            all.push((number, if is_stopped { Ok(None) } else { self.run(planned) }));
        }
    }

    /// Begins or continues a run, and runs it to its end.
    fn run(&self, planned: &Planned) -> anyhow::Result<Option<Ended>> {
        let folder = &planned.folder;
        if RunFiles::is_finished(folder)? {
            let files = planned.checked(RunFiles::open(folder)?)?;
            self.bar.inc(files.run.steps);
            let ended = ended(&files)?;
            self.count(None);
            return Ok(Some(ended));
        }
        let (mut trainer, files) = planned.ready()?;
        let Run { steps: num_steps, target, .. } = files.run;
        let target = Target { success_rate: target, evaluations: 2 };
        let checkpoint_seconds = planned.args.checkpoint_seconds;
        let length = Length::Steps(num_steps);
        let course = Course { length, target, threads: 1, checkpoint_seconds };
        let mut shown = 0;
        let mut show = |steps: u64| {
            self.bar.inc(steps.saturating_sub(shown));
            shown = steps;
        };
        show(trainer.counters().steps);
        let trained = finish::train(&mut trainer, &files, &course, self.signals, |row| {
            show(row.counters.steps);
        });
        let ended = match trained {
            Err(error) if has_diverged(&error) => {
                self.count(Some(&format!("{}: {error:#}", planned.folder.display())));
                // Its checkpoints stay: if the grid goes on, the run diverges again from there.
                show(num_steps);
                return Ok(Some(Ended::Diverged));
            }
            Err(error) => return Err(error),
            Ok(()) if self.signals.received() != 0 => return Ok(None),
            Ok(()) => {
                let outcome = finish::finish(&mut trainer, &files, &course)?;
                self.count(Some(&format!("{}{outcome}", planned.name)));
                ended(&files)?
            }
        };
        files.remove_checkpoints()?;
        show(num_steps);
        Ok(Some(ended))
    }

    /// Counts a run that has ended, and shows how.
    fn count(&self, how: Option<&str>) {
        let num_ended = self.num_ended.fetch_add(1, Ordering::Relaxed) + 1;
        let runs = format!("{num_ended} of {} runs", self.planned.len());
        if let Some(how) = how {
            progress::note(&self.bar, format_args!("{runs}: {how}"));
        }
        self.bar.set_message(runs);
    }
}

impl Planned {
    /// Begins the run, or continues it from its last checkpoint. If it has neither a checkpoint nor
    /// all of its results, it begins again.
    fn ready(&self) -> anyhow::Result<Ready> {
        let Args { env_id, model, seed, .. } = self.args;
        if !RunFiles::has_checkpoint(&self.folder)? {
            let overwrite = RunFiles::is_run(&self.folder);
            if overwrite {
                self.checked(RunFiles::open(&self.folder)?)?;
            }
            let args = Args { overwrite, ..self.args.clone() };
            return start(&args, &self.settings, seed, Box::new(OneProcess));
        }
        let files = self.checked(RunFiles::resume(&self.folder)?)?;
        Ok((Trainer::resume(|| make(env_id, model), &self.folder, 1)?, files))
    }

    /// Checks that the files are those of this run.
    fn checked(&self, files: RunFiles) -> anyhow::Result<RunFiles> {
        ensure!(
            files.run == Run::new(&self.args, self.args.seed),
            "{} has a different run: choose another folder with --out",
            files.folder.display()
        );
        Ok(files)
    }
}

/// Returns how a finished run ended.
fn ended(files: &RunFiles) -> anyhow::Result<Ended> {
    let success = files.read_policy()?.header().success;
    let success = success.context("its policy has no success rate")?;
    let curve = files.read_curve()?;
    let reached = reached(&curve, |line| line.success_rate, files.run.target);
    Ok(Ended::Finished { success_rate: success.rate.value, reached: reached.copied() })
}

/// Whether a run ended because one of its numbers was no longer finite.
fn has_diverged(error: &anyhow::Error) -> bool {
    match error.downcast_ref() {
        Some(TrainError::Policy(_)) => true,
        Some(TrainError::Run { source, .. }) => matches!(**source, RunError::Diverged { .. }),
        _ => false,
    }
}
