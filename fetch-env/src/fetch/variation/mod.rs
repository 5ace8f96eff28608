//! Domain randomization: factors that are drawn for each episode.

pub(crate) mod draw;
pub(crate) mod error;
pub(crate) mod factor;
pub(crate) mod interface;

use std::collections::BTreeMap;

use fetch_sim::{LARGEST_NUMBER, LookFactor, Looks, Physics, SimError, Simulator};
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use self::{
    draw::Draw,
    error::VariationError,
    factor::Factor,
    interface::{InterfaceFactor, InterfaceNumbers},
};
use super::layout::{OBJECT, REACH};
use crate::gym::np_random::NpRandom;
use crate::gym::registry::sort_by_similarity;

/// The factors that are drawn for each episode, and how: domain randomization.
///
/// A reset draws them from a generator beside the environment's own, so that objects and goals start
/// where they do without a variation. All other numbers are the model's. Looks change pictures alone:
/// a kinematic simulator, which has none, accepts them.
/// [`FetchEnv::variation`](crate::FetchEnv::variation) returns those of an episode, also in a vector, by
/// [`VecEnv::env`](crate::VecEnv::env); [`Info`](crate::Info) does not have them.
///
/// ```
/// use fetch_env::variation::{Draw, Variation};
/// use fetch_env::{Env, FetchConfig, RewardKind, Task};
///
/// let variation = Variation::default()
///     .with("object_mass", Draw::LogUniform(0.5, 4.0))?
///     .with("friction", 0.5..=2.0)?
///     .with("action_delay", Draw::Choice(vec![0.0, 1.0]))?
///     .with("table_color_red", 0.0..=1.0)?;
/// let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_variation(variation);
/// # #[cfg(feature = "mujoco")] {
/// let mut env = fetch_env::make(config)?.into_inner();
/// env.reset(Some(0))?;
/// let mass = env.variation().get("object_mass").expect("it varies");
/// assert!((0.5..=4.0).contains(&mass));
/// # }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BTreeMap<Factor, Draw>", into = "BTreeMap<Factor, Draw>")]
#[must_use]
pub struct Variation(BTreeMap<Factor, Draw>);

impl Variation {
    /// Adds a factor. A number or a range may stand for a [`Draw`]. A name that this crate does not
    /// have is a factor of your own task.
    ///
    /// # Errors
    /// [`VariationError::OutOfRange`], [`VariationError::Reversed`],
    /// [`VariationError::NoLogarithm`] or [`VariationError::NoChoice`].
    pub fn with(
        mut self,
        factor: impl Into<Factor>,
        draw: impl Into<Draw>,
    ) -> Result<Self, VariationError> {
        let (factor, draw) = (factor.into(), draw.into());
        draw.check(factor.name(), factor.bounds())?;
        self.0.insert(factor, draw);
        Ok(self)
    }

    /// Returns what varies, in the order in which it is drawn.
    pub fn iter(&self) -> impl Iterator<Item = (&Factor, &Draw)> {
        self.0.iter()
    }

    /// Returns whether nothing varies.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Checks that an environment can vary all this, but for what its task may have.
    pub(super) fn check_built_in<S: Simulator>(&self, simulator: &S) -> Result<(), VariationError> {
        let mut factors = self.0.keys().filter(|factor| !matches!(factor, Factor::Own(_)));
        factors.try_for_each(|factor| check_factor(factor, simulator, &[]))
    }
}

/// Checks that an environment can vary a number.
pub(super) fn check_factor<S: Simulator>(
    factor: &Factor,
    simulator: &S,
    own: &[&str],
) -> Result<(), VariationError> {
    match factor {
        Factor::Physics(factor) => Ok(simulator.can_vary(*factor)?),
        Factor::Look(factor)
            if LookFactor::OBJECT_COLOR.contains(factor) && !simulator.task().has_object() =>
        {
            Err(no_object(factor.name()))
        }
        Factor::Interface(noise)
            if OBJECT.iter().any(|field| field.noise == *noise)
                && REACH.iter().all(|field| field.noise != *noise)
                && !simulator.task().has_object() =>
        {
            Err(no_object(noise.name()))
        }
        Factor::Own(name) if !own.contains(&name.as_str()) => {
            let own = own.iter().map(|&name| name.to_owned());
            let mut nearest: Vec<_> = own.chain(Factor::names().map(String::from)).collect();
            sort_by_similarity(name, &mut nearest);
            nearest.truncate(3);
            Err(VariationError::UnknownFactor { name: name.clone(), nearest })
        }
        _ => Ok(()),
    }
}

fn no_object(factor: &'static str) -> VariationError {
    SimError::CannotVary { factor, reason: "the scene has no object" }.into()
}

impl From<Variation> for BTreeMap<Factor, Draw> {
    fn from(variation: Variation) -> Self {
        variation.0
    }
}

impl TryFrom<BTreeMap<Factor, Draw>> for Variation {
    type Error = VariationError;

    fn try_from(draws: BTreeMap<Factor, Draw>) -> Result<Self, VariationError> {
        let mut draws = draws.into_iter();
        draws.try_fold(Self::default(), |variation, (factor, draw)| variation.with(factor, draw))
    }
}

/// The values that one episode has, where they differ from the model's.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Varied {
    pub(super) physics: Physics,
    pub(super) interface: InterfaceNumbers,
    pub(crate) looks: Looks,
    /// The values of the task's own factors that vary.
    own: SmallVec<[(String, f64); 1]>,
}

impl Varied {
    /// Draws the values of an episode, and then replaces those that are fixed.
    pub(super) fn draw(
        variation: &Variation,
        fixed: &BTreeMap<Factor, f64>,
        random: &mut NpRandom,
    ) -> Result<Self, VariationError> {
        let mut varied = Self::default();
        for (factor, draw) in variation.iter() {
            let drawn = draw.draw(random);
            varied.set(factor, fixed.get(factor).copied().unwrap_or(drawn))?;
        }
        for (factor, &value) in fixed.iter().filter(|(factor, _)| !variation.0.contains_key(factor))
        {
            varied.set(factor, value)?;
        }
        Ok(varied)
    }

    fn set(&mut self, factor: &Factor, value: f64) -> Result<(), VariationError> {
        match factor {
            Factor::Physics(factor) => self.physics = self.physics.with(*factor, value)?,
            Factor::Interface(factor) => {
                let is_whole = matches!(
                    factor,
                    InterfaceFactor::ActionDelay | InterfaceFactor::ObservationDelay
                );
                self.interface.set(*factor, if is_whole { value.round() } else { value });
            }
            Factor::Look(factor) => self.looks = self.looks.with(*factor, value)?,
            Factor::Own(name) => self.own.push((name.clone(), value)),
        }
        Ok(())
    }

    /// Checks numbers that were loaded, given the names of the task's own factors.
    pub(super) fn check(&self, own: &[&str]) -> Result<(), String> {
        let foreign = self.own.iter().find(|(name, value)| {
            !own.contains(&name.as_str()) || value.is_nan() || value.abs() > LARGEST_NUMBER
        });
        foreign.map_or(Ok(()), |(name, value)| Err(format!("{name} is {value} in it")))
    }

    /// Returns the number of a task's own factor.
    pub(super) fn own(&self, name: &str) -> Option<f64> {
        self.own.iter().find(|(own, _)| own == name).map(|&(_, value)| value)
    }

    /// Returns a number by its name, such as `object_mass`; `None` if it is the model's.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        self.iter().find(|&(factor, _)| factor == name).map(|(_, value)| value)
    }

    /// Returns the numbers, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        let physics = self.physics.iter().map(|(factor, value)| (factor.name(), value));
        physics
            .chain(self.interface.iter().map(|(factor, value)| (factor.name(), value)))
            .chain(self.looks.iter().map(|(factor, value)| (factor.name(), value)))
            .chain(self.own.iter().map(|(name, value)| (name.as_str(), *value)))
    }
}
