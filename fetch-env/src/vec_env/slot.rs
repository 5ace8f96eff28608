//! An environment as it travels between threads, with its commands and results.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
};

use super::{batch::Batch, config::AutoresetMode, pool::Job};
use crate::env::goal::{GoalEnv, Info};
use crate::{env::Step, error::EnvError};

/// An environment with its next command and its last results.
pub(super) struct Slot<E: GoalEnv> {
    pub(super) env_id: usize,
    /// `None` after a panic.
    pub(super) env: Option<E>,
    mode: AutoresetMode,
    pub(super) command: Command<E::ResetOptions>,
    pub(super) action: Box<[f32]>,
    /// A batch of one row.
    pub(super) row: Batch,
    reset_is_due: bool,
}

pub(super) enum Command<O> {
    Step,
    Reset { seed: Option<u64>, options: O },
}

impl<E: GoalEnv> Slot<E> {
    pub(super) fn new(env_id: usize, env: E, mode: AutoresetMode, lens: [usize; 3]) -> Self {
        Self {
            env_id,
            mode,
            command: Command::Step,
            action: vec![0.0; env.action_space().len()].into(),
            row: Batch::new(lens, 1),
            env: Some(env),
            reset_is_due: false,
        }
    }

    fn obey(&mut self) -> Result<(), EnvError> {
        let env = self.env.as_mut().ok_or_else(out_of_use)?;
        match &self.command {
            Command::Reset { seed, options } => {
                // If a requested reset fails, repeating it is up to the caller.
                self.reset_is_due = false;
                let reset = env.reset_with(*seed, options)?;
                self.row.set_state(&reset.observation, reset.info);
                Ok(())
            }
            Command::Step if self.reset_is_due => self.autoreset(),
            Command::Step => match env.step(&self.action) {
                Ok(step) => self.finish(&step),
                Err(error) => {
                    if !error.leaves_unchanged() {
                        // If the reset fails as well, the next step tries it again.
                        let _ = self.end_episode();
                    }
                    Err(error)
                }
            },
        }
    }

    fn finish(&mut self, step: &Step<E::Observation, Info>) -> Result<(), EnvError> {
        self.row.set_state(&step.observation, step.info);
        self.row.set_outcome(step.reward, step.terminated, step.truncated);
        if step.is_last() {
            if self.mode == AutoresetMode::SameStep {
                self.row.set_final(&step.observation, step.info);
            }
            self.end_episode()?;
        }
        Ok(())
    }

    fn end_episode(&mut self) -> Result<(), EnvError> {
        self.reset_is_due = self.mode != AutoresetMode::Disabled;
        if self.mode == AutoresetMode::SameStep { self.autoreset() } else { Ok(()) }
    }

    fn autoreset(&mut self) -> Result<(), EnvError> {
        let reset = self.env.as_mut().ok_or_else(out_of_use)?.reset(None)?;
        self.reset_is_due = false;
        self.row.set_state(&reset.observation, reset.info);
        Ok(())
    }
}

impl<E: GoalEnv<ResetOptions: Send> + Send> Job for Slot<E> {
    fn run(&mut self) {
        self.row.begin();
        match catch_unwind(AssertUnwindSafe(|| self.obey())) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => {
                let ends_episode = !error.leaves_unchanged();
                self.row.set_error(error, ends_episode);
            }
            Err(payload) => {
                // Its state is unknown, so it is never used again, and even its drop may panic.
                let env = self.env.take();
                let _ = catch_unwind(AssertUnwindSafe(|| drop(env)));
                self.row.set_error(EnvError::Panicked { message: message(&*payload) }, true);
            }
        }
    }
}

fn out_of_use() -> EnvError {
    EnvError::Panicked { message: "in an earlier step".into() }
}

fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("without a message")
        .to_owned()
}
