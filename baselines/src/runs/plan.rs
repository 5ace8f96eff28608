//! The loop of a run, to its end or until it is stopped.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use super::description::RunDescription;
use super::error::RunsError;
use super::folder::RunFolder;
use crate::learn::{Counters, CurveRow, Learner, SaveLearner, Target, TrainError};
use crate::workers::gather_values;

/// Where a run ends, and how often it is saved on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunPlan {
    /// The length of the run.
    pub length: Length,
    /// The success rate at which it ends before; more than 1 for none.
    pub target: Target,
    /// The minimum time between two checkpoints.
    pub between_checkpoints: Duration,
}

/// The length of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// Environment steps.
    Steps(u64),
    /// Updates from demonstrations alone, without environment steps.
    Updates(u64),
}

/// The number of evaluations of a run that learns from demonstrations alone.
const OFFLINE_EVALUATIONS: u64 = 10;

impl Length {
    /// Returns the number at which the run ends.
    #[must_use]
    pub const fn end(self) -> u64 {
        let (Self::Steps(end) | Self::Updates(end)) = self;
        end
    }

    /// Returns how far a run has got.
    #[must_use]
    pub const fn reached(self, counters: &Counters) -> u64 {
        match self {
            Self::Steps(_) => counters.steps,
            Self::Updates(_) => counters.updates,
        }
    }
}

/// What watches a run: a function that [is called after each cycle](Self::cycle), or a type that can
/// also stop it in the middle of one. `L` is what learns, such as a [`Trainer`](crate::learn::Trainer).
pub trait Watch<L: ?Sized> {
    /// Whether the run goes on. It is called often: after each ten updates, and before each step of
    /// an evaluation. In a run that several processes share, and in one that learns from
    /// demonstrations alone, it is not called.
    fn go_on(&mut self) -> bool {
        true
    }

    /// Is called after each cycle in each process, with the row of the learning curve if there was
    /// an evaluation; the row is in `curve.csv` by then. If it breaks in any process, the run stops.
    fn cycle(&mut self, learner: &L, row: Option<&CurveRow>) -> ControlFlow<()>;
}

impl<L, F> Watch<L> for F
where
    L: ?Sized,
    F: FnMut(&L, Option<&CurveRow>) -> ControlFlow<()>,
{
    fn cycle(&mut self, learner: &L, row: Option<&CurveRow>) -> ControlFlow<()> {
        self(learner, row)
    }
}

impl RunPlan {
    /// Returns the plan of a run: it ends as the description says, when two evaluations in a row
    /// reach the target, and is saved every half minute.
    #[must_use]
    pub fn of(description: &RunDescription) -> Self {
        let length = match description.updates {
            Some(updates) => Length::Updates(updates.get()),
            None => Length::Steps(description.steps),
        };
        Self {
            length,
            target: target_of(description.target),
            between_checkpoints: Duration::from_secs(30),
        }
    }

    /// Whether a run has ended.
    #[must_use]
    pub fn is_over(&self, learner: &(impl Learner + ?Sized)) -> bool {
        match self.length {
            Length::Steps(end) => learner.is_over(end, Some(self.target)),
            Length::Updates(end) => {
                learner.counters().updates >= end || self.target.is_reached(learner.rows())
            }
        }
    }

    /// Runs a learner to its end, or until `watch` stops it, and saves a last checkpoint. The curve
    /// is written at the beginning and after each evaluation. Without a folder, nothing is written.
    ///
    /// # Errors
    /// [`RunsError`] if the training fails, or a file cannot be written.
    pub fn run<L: SaveLearner + ?Sized>(
        &self,
        learner: &mut L,
        folder: Option<&RunFolder>,
        watch: &mut impl Watch<L>,
    ) -> Result<(), RunsError> {
        let mut cycles = self.begin(learner, folder)?;
        while cycles.next(learner, folder, watch)?.is_continue() {}
        if let Some(folder) = folder {
            learner.save(folder.path())?;
        }
        Ok(())
    }

    /// Begins to take the cycles of a run one by one, and writes the curve so far. This is for callers
    /// that do something else between them than a [`Watch`] can; [`run`](Self::run) is the loop over
    /// them.
    ///
    /// # Errors
    /// [`RunsError`] if the curve cannot be written.
    pub fn begin<L: Learner + ?Sized>(
        &self,
        learner: &mut L,
        folder: Option<&RunFolder>,
    ) -> Result<Cycles, RunsError> {
        if let Some(folder) = written_by(learner, folder) {
            folder.write_curve(learner.rows())?;
        }
        Ok(Cycles { plan: *self, saved: Instant::now() })
    }

    /// Continues to the next point at which a run can stop. Returns a row if it was evaluated.
    fn cycle<L: Learner + ?Sized>(
        &self,
        learner: &mut L,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<CurveRow>, TrainError> {
        match self.length {
            Length::Steps(end) => learner.run_cycle_while(end, go_on),
            Length::Updates(end) => {
                let interval = end.div_ceil(OFFLINE_EVALUATIONS);
                let done = learner.counters().updates;
                learner.run_updates((interval - done % interval).min(end - done)).map(Some)
            }
        }
    }
}

/// The cycles of a run, which [`RunPlan::begin`] begins.
#[derive(Debug)]
pub struct Cycles {
    plan: RunPlan,
    /// When the run was saved last.
    saved: Instant,
}

impl Cycles {
    /// Takes the next cycle, unless the run has ended, and writes what is due: the curve, a
    /// checkpoint. It returns whether the run goes on: it has not ended, and `watch` has not stopped
    /// it. If it does not, [`save`](SaveLearner::save) a last checkpoint.
    ///
    /// # Errors
    /// As [`RunPlan::run`].
    pub fn next<L: SaveLearner + ?Sized>(
        &mut self,
        learner: &mut L,
        folder: Option<&RunFolder>,
        watch: &mut impl Watch<L>,
    ) -> Result<ControlFlow<()>, RunsError> {
        if self.plan.is_over(learner) {
            return Ok(ControlFlow::Break(()));
        }
        let row = self.plan.cycle(learner, &mut || watch.go_on())?;
        let written_by = written_by(learner, folder);
        let written = match (written_by, &row) {
            (Some(folder), Some(_)) => folder.write_curve(learner.rows()),
            _ => Ok(()),
        };
        let stops = watch.cycle(learner, row.as_ref()).is_break() || !watch.go_on();
        let is_due = self.saved.elapsed() >= self.plan.between_checkpoints;
        let saves = written_by.is_some() && written.is_ok() && is_due && !stops;
        // In all processes alike.
        let [stops, saves] = any(learner, [stops, saves])?;
        written?;
        if stops {
            return Ok(ControlFlow::Break(()));
        }
        if let Some(folder) = folder.filter(|_| saves) {
            learner.save(folder.path())?;
            self.saved = Instant::now();
        }
        Ok(ControlFlow::Continue(()))
    }
}

/// Returns the folder in the process that writes its files, the first one.
fn written_by<'a, L: Learner + ?Sized>(
    learner: &mut L,
    folder: Option<&'a RunFolder>,
) -> Option<&'a RunFolder> {
    folder.filter(|_| learner.workers().rank() == 0)
}

/// Returns the target of a success rate, which two evaluations in a row must reach.
pub(super) const fn target_of(success_rate: f64) -> Target {
    Target { success_rate, evaluations: 2 }
}

/// Returns, in all processes, which of the flags are set in any of them.
fn any<L: Learner + ?Sized>(learner: &mut L, own: [bool; 2]) -> Result<[bool; 2], RunsError> {
    let all = gather_values(learner.workers(), &own)?;
    Ok([0, 1].map(|flag| all.iter().any(|flags| flags[flag])))
}
