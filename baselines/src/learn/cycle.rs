//! The loop of a run, and its cycles: collect, update, evaluate.

use std::ops::ControlFlow;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::curve::{CurveRow, Target};
use super::env::LearnEnv;
use super::error::TrainError;
use super::trainer::Trainer;
use crate::evaluate::EvaluationError;
use crate::workers::sum;

/// The number of evaluations of a run whose settings do not say how often to evaluate.
const DEFAULT_EVALUATIONS: u64 = 20;

/// The rest of a cycle that was stopped after it had collected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rest {
    /// The number of updates that are left.
    pub(super) updates: u64,
    /// Whether the steps of the cycle have completed an interval between evaluations.
    ends_interval: bool,
}

impl<E: LearnEnv> Trainer<E> {
    /// Runs until `num_steps` steps have been collected in total, the target is reached, or `watch`
    /// breaks, in any process; `watch` gets this trainer and each row of the learning curve. It
    /// evaluates as often as [`evaluation_interval`](super::ScheduleSettings::evaluation_interval)
    /// says, and at the end of all steps if there is no row yet.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn run(
        &mut self,
        num_steps: u64,
        target: Option<Target>,
        mut watch: impl FnMut(&mut Self, &CurveRow) -> ControlFlow<()>,
    ) -> Result<(), TrainError> {
        while !self.is_over(num_steps, target) {
            if let Some(row) = self.run_cycle(num_steps)? {
                let is_over = watch(self, &row).is_break();
                if sum(&mut *self.workers, u64::from(is_over))? > 0 {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Whether a run of `num_steps` steps has ended: it has collected them, and its last cycle was
    /// not stopped; or its target is reached.
    #[must_use]
    pub fn is_over(&self, num_steps: u64, target: Option<Target>) -> bool {
        let is_complete = self.counters.steps >= num_steps && self.rest.is_none();
        is_complete || target.is_some_and(|target| target.is_reached(&self.rows))
    }

    /// Runs the next cycle of a run of `num_steps` steps, as [`run`](Self::run) does, for callers
    /// that inspect each cycle. Returns a row of the learning curve if an evaluation was due.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn run_cycle(&mut self, num_steps: u64) -> Result<Option<CurveRow>, TrainError> {
        self.run_cycle_while(num_steps, || true)
    }

    /// Runs the next cycle as [`run_cycle`](Self::run_cycle) does, but stops in the middle, without
    /// a row, when `go_on` returns false. The next call finishes the cycle, also after
    /// [`save`](Self::save) and [`resume`](Self::resume), with the same bits as if it had not been
    /// stopped.
    ///
    /// `go_on` is called on this thread: after each ten updates, and before each step of an
    /// evaluation, which begins again if it was stopped. In a run that several processes share it
    /// is not called, because they would wait for the one that stops.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn run_cycle_while(
        &mut self,
        num_steps: u64,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<Option<CurveRow>, TrainError> {
        let is_alone = self.workers.size() == 1;
        let mut go_on = || !is_alone || go_on();
        let interval = self.settings.schedule.evaluation_interval;
        let steps = interval.unwrap_or(num_steps.div_ceil(DEFAULT_EVALUATIONS)).max(1);
        let before = self.counters.steps / steps;
        self.learner.check_process()?;
        let mut rest = match self.rest {
            Some(rest) => rest,
            None => {
                let updates = self.begin_cycle()?;
                Rest { updates, ends_interval: self.counters.steps / steps > before }
            }
        };
        rest.updates = self.finish_cycle(rest.updates, &mut go_on)?;
        self.rest = Some(rest);
        if rest.updates > 0 {
            return Ok(None);
        }
        let is_due = self.counters.updates > 0 && rest.ends_interval;
        // The last row shows the result of the run.
        let is_last = self.counters.steps >= num_steps;
        let row = if is_due || (is_last && (interval.is_none() || self.rows.is_empty())) {
            let row = match self.evaluate_while(&mut go_on) {
                Err(TrainError::Evaluate(EvaluationError::Stopped)) => return Ok(None),
                row => row?,
            };
            self.check_weights()?;
            Some(row)
        } else {
            None
        };
        self.rest = None;
        Ok(row)
    }

    /// Collects steps of all environments, and then updates the actor.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn cycle(&mut self) -> Result<(), TrainError> {
        self.learner.check_process()?;
        let updates = match self.rest.take() {
            Some(rest) => rest.updates,
            None => self.begin_cycle()?,
        };
        self.finish_cycle(updates, &mut || true)?;
        Ok(())
    }

    /// Collects steps of all environments. Returns the number of updates that follow.
    fn begin_cycle(&mut self) -> Result<u64, TrainError> {
        let start = Instant::now();
        let can_draw = self.collect()?;
        self.counters.seconds += start.elapsed().as_secs_f64();
        let random_episodes = self.settings.random_episodes_of_all(self.workers.size());
        let learns = can_draw && self.counters.episodes >= random_episodes;
        Ok(if learns { self.settings.schedule.updates_per_cycle as u64 } else { 0 })
    }

    /// Updates the actor while `go_on` returns true. Returns the number of updates that are left.
    fn finish_cycle(
        &mut self,
        num_updates: u64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<u64, TrainError> {
        let start = Instant::now();
        let left = self.learn(num_updates, go_on)?;
        self.counters.seconds += start.elapsed().as_secs_f64();
        Ok(left)
    }
}
