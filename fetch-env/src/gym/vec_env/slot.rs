//! An environment as it travels between threads, with its commands and results.

use std::{
    any::Any,
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
};

use super::config::AutoresetMode;
use super::pool::Job;
use super::step::VecStepOf;
use crate::gym::env::observation::BatchObservation;
use crate::gym::env::{ActionElement, Env, Reset, Step};
use crate::gym::error::EnvError;
use crate::gym::vec_env::error::VecEnvError;

/// Chooses the seed and the options of the episodes that autoresets begin.
pub(super) type ChooseStart<O> = dyn Fn(usize, u64) -> (Option<u64>, O) + Send + Sync;

/// An environment with its next command and its last results.
pub(super) struct Slot<E: Env<Observation: BatchObservation>> {
    pub(super) env_index: usize,
    /// `None` after a panic.
    pub(super) env: Option<E>,
    mode: AutoresetMode,
    pub(super) choose_start: Option<Arc<ChooseStart<E::ResetOptions>>>,
    pub(super) command: Command<E::ResetOptions>,
    pub(super) action: Box<[ActionElement<E>]>,
    /// The results of only this environment: one row.
    pub(super) row: VecStepOf<E>,
    /// Whether a reset was ever requested.
    pub(super) was_reset: bool,
    /// Whether the next step begins an episode, or is refused without an autoreset.
    pub(super) reset_is_due: bool,
    /// The number of episodes that have begun.
    pub(super) num_episodes: u64,
}

pub(super) enum Command<O> {
    Step,
    Reset { seed: Option<u64>, options: O },
}

impl<E: Env<Observation: BatchObservation>> Slot<E> {
    pub(super) fn new(env_index: usize, env: E, mode: AutoresetMode, row: VecStepOf<E>) -> Self {
        Self {
            env_index,
            env: Some(env),
            mode,
            choose_start: None,
            command: Command::Step,
            action: row.action().into(),
            row,
            was_reset: false,
            reset_is_due: false,
            num_episodes: 0,
        }
    }

    /// Checks that a reset was requested, so that the environment can take a step.
    pub(super) fn check_reset(&self) -> Result<(), VecEnvError> {
        let Self { env_index, was_reset, .. } = *self;
        if was_reset { Ok(()) } else { Err(VecEnvError::ResetNeeded { env_index }) }
    }

    fn obey(&mut self) -> Result<(), EnvError> {
        let env = self.env.as_mut().ok_or_else(out_of_use)?;
        match &self.command {
            Command::Reset { seed, options } => {
                let reset = env.reset_with(*seed, options).inspect_err(|error| {
                    // If a requested reset fails, repeating it is up to the caller.
                    self.reset_is_due &= error.refuses_options();
                })?;
                self.begin_episode(reset)
            }
            Command::Step if self.reset_is_due && self.mode == AutoresetMode::Disabled => {
                Err(EnvError::ResetNeeded)
            }
            Command::Step if self.reset_is_due => self.autoreset(),
            Command::Step => match env.step(&self.action) {
                Ok(step) => self.finish(step),
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

    fn finish(&mut self, step: Step<E::Observation, E::Info>) -> Result<(), EnvError> {
        let is_last = step.is_last();
        self.row.set_action(&self.action);
        // The environment has taken the step even if the row cannot show it.
        self.row
            .set_step(&step.observation, step.info)
            .inspect_err(|_| self.reset_is_due = true)?;
        self.row.set_outcome(step.reward, step.terminated, step.truncated);
        if is_last { self.end_episode() } else { Ok(()) }
    }

    fn end_episode(&mut self) -> Result<(), EnvError> {
        self.reset_is_due = self.mode != AutoresetMode::Disabled;
        if self.mode == AutoresetMode::SameStep { self.autoreset() } else { Ok(()) }
    }

    fn autoreset(&mut self) -> Result<(), EnvError> {
        let env = self.env.as_mut().ok_or_else(out_of_use)?;
        let reset = match &self.choose_start {
            None => env.reset(None)?,
            Some(choose) => {
                let (seed, options) = choose(self.env_index, self.num_episodes);
                env.reset_with(seed, &options)?
            }
        };
        self.begin_episode(reset)
    }

    fn begin_episode(&mut self, reset: Reset<E::Observation, E::Info>) -> Result<(), EnvError> {
        self.num_episodes += 1;
        let shown = self.row.set_start(&reset.observation, Some(reset.info));
        self.reset_is_due = shown.is_err();
        shown
    }
}

impl<E: Env<Observation: BatchObservation> + Send> Job for Slot<E> {
    fn run(&mut self) {
        // Clearing the row drops an info, which is the environment's code as well.
        let result = contain(|| {
            self.row.begin();
            self.obey()
        });
        let result = result.unwrap_or_else(|message| {
            // Its state is unknown, so it is never used again, and even its drop may panic.
            let env = self.env.take();
            let _ = contain(|| drop(env));
            Err(EnvError::Panicked { message })
        });
        if let Err(error) = result {
            let ends_episode = !error.leaves_unchanged() && !error.refuses_options();
            self.row.set_error(error, ends_episode);
        }
        self.row.count();
    }
}

/// Calls code of an environment. If it panics, returns the message of the panic.
fn contain<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(call)).map_err(|payload| {
        let message = message(&*payload);
        // Its drop is the environment's code too, and may panic in turn.
        mem::forget(payload);
        message
    })
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
