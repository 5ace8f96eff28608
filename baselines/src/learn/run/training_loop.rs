//! The loop of a run: collect steps, store what they show, update the actor, evaluate it.

use std::ops::ControlFlow;

use super::curve::{Counters, CurveRow, Target};
use super::env::LearnEnv;
use super::learner::{self, Learner};
use super::trainer::{Rest, Trainer};
use crate::evaluate::EvaluationError;
use crate::learn::error::TrainError;
use crate::learn::settings::train::json_text;
use crate::trained::{AnyPolicy, TrainedPolicyError};
use crate::workers::Workers;

/// The number of evaluations of a run whose settings do not say how often to evaluate.
const DEFAULT_EVALUATIONS: u64 = 20;

impl<E: LearnEnv> Trainer<E> {
    /// Runs until `num_steps` steps have been collected in total, the target is reached, or `watch`
    /// breaks, in any process; `watch` gets this trainer and each row of the learning curve. It
    /// evaluates as often as
    /// [`evaluation_interval`](crate::learn::ScheduleSettings::evaluation_interval) says, and at
    /// the end of all steps if there is no row yet.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn run(
        &mut self,
        num_steps: u64,
        target: Option<Target>,
        watch: impl FnMut(&mut Self, &CurveRow) -> ControlFlow<()>,
    ) -> Result<(), TrainError> {
        learner::run(self, num_steps, target, watch)
    }

    /// Whether a run of `num_steps` steps has ended: it has collected them, and its last cycle was
    /// not stopped; or its target is reached.
    #[must_use]
    pub fn is_over(&self, num_steps: u64, target: Option<Target>) -> bool {
        Learner::is_over(self, num_steps, target)
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
        self.updates.check_process()?;
        let mut rest = match self.rest {
            Some(rest) => rest,
            None => {
                let collected = self.collect()?;
                let updates = self.store(collected)?;
                Rest { updates, ends_interval: self.counters.steps / steps > before }
            }
        };
        rest.updates = self.update_while(rest.updates, &mut go_on)?;
        self.rest = Some(rest);
        if rest.updates > 0 {
            return Ok(None);
        }
        let is_due = self.counters.updates > 0 && rest.ends_interval;
        // The last row shows the result of the run.
        let is_last = self.counters.steps >= num_steps;
        let row = if is_due || (is_last && (interval.is_none() || self.rows.is_empty())) {
            match self.evaluate_while(&mut go_on) {
                Err(TrainError::Evaluate(EvaluationError::Stopped)) => return Ok(None),
                row => Some(row?),
            }
        } else {
            None
        };
        self.rest = None;
        Ok(row)
    }
}

impl<E: LearnEnv> Learner for Trainer<E> {
    fn counters(&self) -> &Counters {
        &self.counters
    }

    fn rows(&self) -> &[CurveRow] {
        &self.rows
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn settings_json(&self) -> String {
        json_text(&self.settings)
    }

    fn evaluation_episodes(&self) -> usize {
        self.settings.schedule.evaluation_episodes
    }

    fn workers(&mut self) -> &mut dyn Workers {
        &mut *self.workers
    }

    fn any_policy(&self, env_id: &str) -> Result<AnyPolicy, TrainedPolicyError> {
        #[cfg(feature = "render")]
        if self.eyes.is_some() {
            return self.pixel_policy(env_id).map(Box::new).map(AnyPolicy::Pixels);
        }
        self.policy(env_id).map(AnyPolicy::State)
    }

    fn is_complete(&self, num_steps: u64) -> bool {
        self.counters.steps >= num_steps && self.rest.is_none()
    }

    fn run_cycle_while(
        &mut self,
        num_steps: u64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<CurveRow>, TrainError> {
        Self::run_cycle_while(self, num_steps, go_on)
    }

    fn run_updates(&mut self, num_updates: u64) -> Result<CurveRow, TrainError> {
        self.update(num_updates)?;
        self.evaluate()
    }
}
