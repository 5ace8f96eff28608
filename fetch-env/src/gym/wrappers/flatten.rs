//! Goal-conditioned observations as one vector.

use super::array::{ArrayPool, SharedArray};
use super::macros::keep;
use super::wrapper::{Resetting, Stateless, Wrapper};
use crate::gym::env::{ActionElement, Env, Reset, Step, observation::GoalObservation};
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Turns goal-conditioned observations into single vectors of `f32`, for learners without goals,
/// such as PPO.
///
/// [`new`](Self::new) appends the desired goal to the observation, which is what most
/// implementations of hindsight replay feed to a network. [`with_keys`](Self::with_keys) chooses
/// parts and order: `["achieved_goal", "desired_goal", "observation"]` gives the numbers of
/// Gymnasium's wrapper of this name (there in double precision).
///
/// The environment is then not a [`GoalEnv`](crate::GoalEnv). Observations reuse memory; a step
/// allocates nothing unless many observations are kept.
///
/// ```
/// use fetch_env::{Env, EnvExt, GoalObservation, make_kinematic, wrappers::FlattenObservation};
///
/// let mut env = make_kinematic("FetchPush-v4")?.wrap(FlattenObservation::new())?;
/// let observation = env.reset(Some(0))?.observation;
/// assert_eq!(observation.len(), 25 + 3);
/// let goal = env.inner().inner().desired_goal().ok_or("no goal")?;
/// assert!(observation[25..].iter().zip(goal).all(|(to, from)| *to == *from as f32));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct FlattenObservation {
    keys: Vec<String>,
    /// The parts and their lengths; none without an environment.
    parts: Vec<(Part, usize)>,
    observation_space: Option<Space>,
    pool: ArrayPool<f32>,
}

/// A part of a goal-conditioned observation.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    AchievedGoal,
    DesiredGoal,
    Observation,
}

impl Part {
    const ALL: [Self; 3] = [Self::AchievedGoal, Self::DesiredGoal, Self::Observation];
    const DEFAULT: [Self; 2] = [Self::Observation, Self::DesiredGoal];

    const fn key(self) -> &'static str {
        match self {
            Self::AchievedGoal => "achieved_goal",
            Self::DesiredGoal => "desired_goal",
            Self::Observation => "observation",
        }
    }
}

impl Default for FlattenObservation {
    fn default() -> Self {
        Self::new()
    }
}

impl FlattenObservation {
    /// Takes the observation, then the desired goal.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns a [`SpaceError`] if the observation space lacks one
    /// of them.
    #[must_use]
    pub fn new() -> Self {
        Self::with_keys(Part::DEFAULT.map(Part::key))
    }

    /// Takes the parts of these keys, in this order.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns a [`SpaceError`] for an unknown key, a key that occurs
    /// twice, or no keys.
    #[must_use]
    pub fn with_keys(keys: impl IntoIterator<Item: Into<String>>) -> Self {
        let keys = keys.into_iter().map(Into::into).collect();
        Self { keys, parts: Vec::new(), observation_space: None, pool: ArrayPool::new(0) }
    }
}

/// Appends the bounds of a part. Rounding keeps the order, so that rounded members stay between
/// rounded bounds.
fn extend<T: Element>(low: &mut Vec<f32>, high: &mut Vec<f32>, space: &BoxSpace<T>) -> usize {
    let single = |&bound: &T| bound.into() as f32;
    low.extend(space.low().iter().map(single));
    high.extend(space.high().iter().map(single));
    space.len()
}

impl FlattenObservation {
    fn observe<O: GoalObservation>(
        &mut self,
        observation: &O,
    ) -> Result<SharedArray<f32>, EnvError> {
        for &(part, expected) in &self.parts {
            let actual = match part {
                Part::AchievedGoal => observation.achieved_goal().len(),
                Part::DesiredGoal => observation.desired_goal().len(),
                Part::Observation => observation.observation().len(),
            };
            if actual != expected {
                return Err(EnvError::ObservationLength { key: part.key(), expected, actual });
            }
        }
        let parts = &self.parts;
        Ok(self.pool.write(|mut vector| {
            for &(part, len) in parts {
                let out;
                (out, vector) = vector.split_at_mut(len);
                match part {
                    Part::AchievedGoal => round(out, observation.achieved_goal()),
                    Part::DesiredGoal => round(out, observation.desired_goal()),
                    Part::Observation => round(out, observation.observation()),
                }
            }
        }))
    }
}

fn round<T: Element>(out: &mut [f32], part: &[T]) {
    for (out, &element) in out.iter_mut().zip(part) {
        *out = element.into() as f32;
    }
}

impl<E: Env<Observation: GoalObservation>> Wrapper<E> for FlattenObservation {
    type Observation = SharedArray<f32>;
    keep!(Info, ActionSpace);

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<SharedArray<f32>, E::Info>, EnvError> {
        env.reset_with(seed, options)?.try_map_observation(|observation| self.observe(&observation))
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<SharedArray<f32>, E::Info>, EnvError> {
        env.step(action)?.try_map_observation(|observation| self.observe(&observation))
    }

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        let mut parts = Vec::new();
        let (mut low, mut high) = (Vec::new(), Vec::new());
        for key in &self.keys {
            let unknown = || SpaceError::Key { key: key.clone() };
            let part = Part::ALL.into_iter().find(|part| part.key() == key).ok_or_else(unknown)?;
            let space = env.observation_space().as_dict().and_then(|dict| dict.get(key));
            let len = match space {
                Some(Space::BoxF32(space)) => extend(&mut low, &mut high, space),
                Some(Space::BoxF64(space)) => extend(&mut low, &mut high, space),
                _ => return Err(unknown().into()),
            };
            if parts.iter().any(|&(other, _)| other == part) {
                return Err(unknown().into());
            }
            parts.push((part, len));
        }
        if low.is_empty() {
            return Err(SpaceError::Nothing.into());
        }
        let len = low.len();
        self.observation_space = Some(BoxSpace::new(vec![len], low, high)?.into());
        self.pool = ArrayPool::new(len);
        self.parts = parts;
        Ok(())
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        self.observation_space.as_ref().unwrap_or_else(|| env.observation_space())
    }
}

impl Stateless for FlattenObservation {}
