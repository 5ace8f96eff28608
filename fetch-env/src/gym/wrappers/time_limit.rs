//! The time limit of episodes.

use std::num::NonZeroU32;

use super::macros::keep;
use super::wrapped::Wrapped;
use super::wrapper::{KeepsGoals, Resetting, SnapshotWrapper, Wrapper};
use crate::gym::env::{ActionElement, Env, Reset, Step};
use crate::gym::error::EnvError;

/// Truncates episodes after a number of steps.
///
/// A step after the end, set by the limit or by the environment itself, is an error until the next
/// reset. If an episode ends in both ways in one step, both `terminated` and `truncated` are true.
///
/// [`compute_truncated`](crate::GoalEnvExt::compute_truncated) ignores the limit, which is not a
/// function of the goals.
///
/// ```
/// use fetch_env::{Env, EnvExt, TimeLimit, make_kinematic};
///
/// let env = make_kinematic("FetchReach-v4")?; // which has a limit of 50 steps
/// let mut env = env.wrap(TimeLimit::new(2.try_into()?))?;
/// env.reset(Some(0))?;
/// assert!(!env.step(&[0.0; 4])?.truncated);
/// assert!(env.step(&[0.0; 4])?.truncated);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct TimeLimit {
    max_episode_steps: NonZeroU32,
    elapsed_steps: u32,
    is_over: bool,
}

impl TimeLimit {
    /// Creates a limit of `max_episode_steps` steps.
    #[must_use]
    pub const fn new(max_episode_steps: NonZeroU32) -> Self {
        Self { max_episode_steps, elapsed_steps: 0, is_over: false }
    }
}

impl<E> Wrapped<E, TimeLimit> {
    /// Returns the number of steps after which an episode is truncated.
    #[must_use]
    pub const fn max_episode_steps(&self) -> NonZeroU32 {
        self.wrapper.max_episode_steps
    }

    /// Returns the number of steps taken in this episode; 0 before the first reset.
    #[must_use]
    pub const fn elapsed_steps(&self) -> u32 {
        self.wrapper.elapsed_steps
    }
}

impl<E: Env> Wrapper<E> for TimeLimit {
    keep!(Observation, Info, ActionSpace);

    fn attach(&mut self, _env: &E) -> Result<(), EnvError> {
        *self = Self::new(self.max_episode_steps);
        Ok(())
    }

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<E::Observation, E::Info>, EnvError> {
        let reset = env.reset_with(seed, options)?;
        *self = Self::new(self.max_episode_steps);
        Ok(reset)
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        if self.is_over {
            return Err(EnvError::EpisodeOver);
        }
        let mut step = env.step(action)?;
        self.elapsed_steps += 1;
        step.truncated |= self.elapsed_steps >= self.max_episode_steps.get();
        self.is_over = step.is_last();
        Ok(step)
    }
}

impl KeepsGoals for TimeLimit {
    const KEEPS_SYMMETRIES: bool = true;
}

/// The state is the number of steps taken, and whether the episode is over.
impl SnapshotWrapper for TimeLimit {
    type State = (u32, bool);

    fn state(&self) -> (u32, bool) {
        (self.elapsed_steps, self.is_over)
    }

    fn check_state(&self, &(elapsed_steps, is_over): &(u32, bool)) -> Result<(), EnvError> {
        let limit = self.max_episode_steps.get();
        if elapsed_steps < limit || (is_over && elapsed_steps == limit) {
            return Ok(());
        }
        let reason = format!("{elapsed_steps} steps were taken, the limit is {limit}");
        Err(EnvError::ForeignSnapshot { reason })
    }

    fn set_state(&mut self, &(elapsed_steps, is_over): &(u32, bool)) {
        (self.elapsed_steps, self.is_over) = (elapsed_steps, is_over);
    }
}
