//! Return and length of each finished episode.

use serde::{Deserialize, Serialize};

use super::macros::keep;
use super::wrapped::Wrapped;
use super::wrapper::{KeepsGoals, Resetting, SnapshotWrapper, Wrapper};
use crate::gym::env::{ActionElement, Env, Reset, Step, goal::Info};
use crate::gym::error::EnvError;

/// Adds the return and the length of each finished episode to the info of its last step.
///
/// Unlike Gymnasium's, they contain no wall-clock time, so equal episodes have equal infos. A step
/// allocates nothing.
///
/// ```
/// use fetch_env::{Env, EnvExt, make_kinematic, wrappers::RecordEpisodeStatistics};
///
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(RecordEpisodeStatistics::new())?;
/// env.reset(Some(0))?;
/// let episode = loop {
///     if let Some(episode) = env.step(&[0.0; 4])?.info.episode {
///         break episode;
///     }
/// };
/// assert_eq!((episode.episode_return, episode.episode_length), (-50.0, 50));
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct RecordEpisodeStatistics(EpisodeStatistics);

impl RecordEpisodeStatistics {
    /// Creates a record without steps.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl<E> Wrapped<E, RecordEpisodeStatistics> {
    /// Returns the return and the length of the episode so far.
    #[must_use]
    pub const fn so_far(&self) -> EpisodeStatistics {
        self.wrapper.0
    }
}

/// Return and length of an episode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct EpisodeStatistics {
    /// The return: the sum of all rewards, without discount.
    pub episode_return: f64,
    /// The number of steps, which stops at the largest `u32`.
    pub episode_length: u32,
}

/// The info of a [`RecordEpisodeStatistics`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct EpisodeInfo<I> {
    /// The info of the wrapped environment.
    pub info: I,
    /// Return and length of the episode, in the info of its last step.
    pub episode: Option<EpisodeStatistics>,
}

impl<I: AsRef<Info>> AsRef<Info> for EpisodeInfo<I> {
    fn as_ref(&self) -> &Info {
        self.info.as_ref()
    }
}

impl<E: Env> Wrapper<E> for RecordEpisodeStatistics {
    type Info = EpisodeInfo<E::Info>;
    keep!(Observation, ActionSpace);

    fn attach(&mut self, _env: &E) -> Result<(), EnvError> {
        *self = Self::new();
        Ok(())
    }

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<E::Observation, Self::Info>, EnvError> {
        let reset = env.reset_with(seed, options)?;
        *self = Self::new();
        Ok(reset.map_info(|info| EpisodeInfo { info, episode: None }))
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<E::Observation, Self::Info>, EnvError> {
        let step = env.step(action)?;
        self.0.episode_return += step.reward;
        self.0.episode_length = self.0.episode_length.saturating_add(1);
        let episode = step.is_last().then_some(self.0);
        Ok(step.map_info(|info| EpisodeInfo { info, episode }))
    }
}

impl KeepsGoals for RecordEpisodeStatistics {
    const KEEPS_SYMMETRIES: bool = true;
}

impl SnapshotWrapper for RecordEpisodeStatistics {
    type State = EpisodeStatistics;

    fn state(&self) -> EpisodeStatistics {
        self.0
    }

    fn check_state(&self, state: &EpisodeStatistics) -> Result<(), EnvError> {
        if state.episode_return.is_finite() {
            return Ok(());
        }
        let reason = format!("its return is {}", state.episode_return);
        Err(EnvError::ForeignSnapshot { reason })
    }

    fn set_state(&mut self, state: &EpisodeStatistics) {
        self.0 = *state;
    }
}
