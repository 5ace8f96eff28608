//! Goal-conditioned observations as one vector.

use super::array::{ArrayPool, SharedArray};
use super::macros::{keep, observe};
use super::wrapped::{Stateless, Wrapped, Wrapper};
use crate::gym::env::{Env, observation::GoalObservation};
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
};
use crate::gym::{error::EnvError, wrappers::error::WrapperError};

/// A goal-conditioned environment whose observations are single vectors of `f32`, for learners that
/// know no goals, such as PPO.
///
/// `new` appends the desired goal to the observation, which is what most implementations of hindsight
/// replay feed to a network. [`with_keys`](Wrapped::with_keys) chooses parts and order:
/// `["achieved_goal", "desired_goal", "observation"]` gives the numbers of Gymnasium's wrapper of
/// this name (there in double precision).
///
/// It is no [`GoalEnv`](crate::GoalEnv). Observations share memory that is used again; a step
/// allocates nothing unless many observations are kept.
///
/// ```
/// use fetch_env::{Env, GoalObservation, make_kinematic, wrappers::FlattenObservation};
///
/// let env = make_kinematic("FetchPush-v4")?;
/// let mut env = FlattenObservation::new(env)?;
/// let observation = env.reset(Some(0))?.observation;
/// assert_eq!(observation.len(), 25 + 3);
/// let goal = env.inner().inner().desired_goal().ok_or("no goal")?;
/// assert_eq!(observation[25..], goal.map(|x| x as f32));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type FlattenObservation<E> = Wrapped<E, Flatten>;

/// The wrapper of a [`FlattenObservation`].
#[derive(Clone, Debug)]
pub struct Flatten {
    /// The parts and their lengths.
    parts: Vec<(Part, usize)>,
    observation_space: Space,
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

impl<E: Env<Observation: GoalObservation>> FlattenObservation<E> {
    /// Flattens the observations of `env`: the observation, then the desired goal.
    ///
    /// # Errors
    /// [`EnvError::Wrapper`] if the observation space lacks a part.
    pub fn new(env: E) -> Result<Self, EnvError> {
        Self::with_keys(env, Part::DEFAULT.map(Part::key))
    }

    /// Flattens the parts of these keys, in this order.
    ///
    /// # Errors
    /// [`EnvError::Wrapper`] for an unknown key, a key that occurs twice, or none.
    pub fn with_keys<'a>(
        env: E,
        keys: impl IntoIterator<Item = &'a str>,
    ) -> Result<Self, EnvError> {
        let mut parts = Vec::new();
        let (mut low, mut high) = (Vec::new(), Vec::new());
        for key in keys {
            let unknown = || WrapperError::Key { key: key.into() };
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
            return Err(WrapperError::Nothing.into());
        }
        let len = low.len();
        let observation_space = BoxSpace::new(vec![len], low, high)?.into();
        Ok(Self::from_parts(env, Flatten { parts, observation_space, pool: ArrayPool::new(len) }))
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

impl Flatten {
    fn observe<O: GoalObservation>(
        &mut self,
        observation: O,
        _is_first: bool,
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

impl<E: Env<Observation: GoalObservation>> Wrapper<E> for Flatten {
    type Observation = SharedArray<f32>;
    keep!(Info, ActionSpace);
    observe!();

    fn observation_space<'a>(&'a self, _env: &'a E) -> &'a Space {
        &self.observation_space
    }
}

impl Stateless for Flatten {}
