//! A wrapper whose info contains more than the environment's: how close the episode has come to its
//! goal so far. Everything else is the wrapped environment's, including the rewards.

use fetch_env::wrappers::{KeepsGoals, Resetting, SnapshotWrapper, Wrapper};
use fetch_env::{ActionElement, Env, EnvError, Info, Reset, Space, Step};

/// Reports the smallest distance of the episode.
#[derive(Clone, Debug)]
pub struct Closest {
    closest: f64,
}

/// The environment's own info, and what the wrapper adds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestInfo<I> {
    pub own: I,
    /// The smallest distance between the goals since the reset.
    pub closest: f64,
}

/// The common part is the environment's own.
impl<I: AsRef<Info>> AsRef<Info> for ClosestInfo<I> {
    fn as_ref(&self) -> &Info {
        self.own.as_ref()
    }
}

impl Default for Closest {
    fn default() -> Self {
        Self::new()
    }
}

impl Closest {
    pub const fn new() -> Self {
        Self { closest: f64::INFINITY }
    }

    fn info<I: AsRef<Info>>(&mut self, own: I) -> ClosestInfo<I> {
        self.closest = self.closest.min(own.as_ref().distance);
        ClosestInfo { own, closest: self.closest }
    }
}

impl<E: Env<Info: AsRef<Info>>> Wrapper<E> for Closest {
    type Observation = E::Observation;
    type Info = ClosestInfo<E::Info>;
    type ActionSpace = E::ActionSpace;

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<E::Observation, Self::Info>, EnvError> {
        let Reset { observation, info } = env.reset_with(seed, options)?;
        self.closest = f64::INFINITY;
        Ok(Reset { observation, info: self.info(info) })
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<E::Observation, Self::Info>, EnvError> {
        let Step { observation, reward, terminated, truncated, info } = env.step(action)?;
        Ok(Step { observation, reward, terminated, truncated, info: self.info(info) })
    }

    fn action_space<'a>(&'a self, env: &'a E) -> &'a E::ActionSpace {
        env.action_space()
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        env.observation_space()
    }
}

/// Rewards, success and termination are the environment's.
impl KeepsGoals for Closest {}

/// The state is the smallest distance. `None` stands for the infinity before the first reset, which
/// JSON cannot write.
impl SnapshotWrapper for Closest {
    type State = Option<f64>;

    fn state(&self) -> Option<f64> {
        self.closest.is_finite().then_some(self.closest)
    }

    fn check_state(&self, _state: &Option<f64>) -> Result<(), EnvError> {
        Ok(())
    }

    fn set_state(&mut self, state: &Option<f64>) {
        self.closest = state.unwrap_or(f64::INFINITY);
    }
}
