//! What may differ between episodes.

use std::fmt;

use fetch_sim::{LARGEST_NUMBER, PhysicsFactor};
use serde::{Deserialize, Serialize};

/// The largest delay of actions, in steps.
pub const MAX_ACTION_DELAY: u32 = 50;

pub(super) const ACTION_DELAY: &str = "action_delay";

/// What may differ between episodes: a number of the physics, of the interface, or of a task of your
/// own.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
#[non_exhaustive]
pub enum Factor {
    /// A number of the physics.
    Physics(PhysicsFactor),
    /// `action_delay`: the number of whole steps, up to 50, by which actions come late. What is drawn
    /// is rounded. Until the first action comes, the robot holds its position.
    ActionDelay,
    /// A number of your own task, by one of the names in
    /// [`FetchTask::factors`](crate::FetchTask::factors).
    Own(String),
}

impl Factor {
    /// Returns the name, such as `object_mass`.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Physics(factor) => factor.name(),
            Self::ActionDelay => ACTION_DELAY,
            Self::Own(name) => name,
        }
    }

    /// Returns the smallest and the largest value.
    #[must_use]
    pub const fn bounds(&self) -> [f64; 2] {
        match self {
            Self::Physics(factor) => factor.bounds(),
            Self::ActionDelay => [0.0, MAX_ACTION_DELAY as f64],
            Self::Own(_) => [-LARGEST_NUMBER, LARGEST_NUMBER],
        }
    }

    /// Returns the names of all factors but a task's own.
    pub(super) fn names() -> impl Iterator<Item = &'static str> {
        PhysicsFactor::ALL.iter().map(|factor| factor.name()).chain([ACTION_DELAY])
    }
}

impl fmt::Display for Factor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl From<PhysicsFactor> for Factor {
    fn from(factor: PhysicsFactor) -> Self {
        Self::Physics(factor)
    }
}

/// Returns the factor of this name: a task's own, unless it is one of this crate's.
impl From<&str> for Factor {
    fn from(name: &str) -> Self {
        match name.parse() {
            Ok(factor) => Self::Physics(factor),
            Err(_) if name == ACTION_DELAY => Self::ActionDelay,
            Err(_) => Self::Own(name.into()),
        }
    }
}

impl From<String> for Factor {
    fn from(name: String) -> Self {
        name.as_str().into()
    }
}

impl From<Factor> for String {
    fn from(factor: Factor) -> Self {
        factor.name().into()
    }
}
