//! What may differ between episodes.

use std::fmt;

use fetch_sim::{LARGEST_NUMBER, LookFactor, PhysicsFactor};
use serde::{Deserialize, Serialize};

use super::interface::InterfaceFactor;

/// What may differ between episodes: a number of the physics, of the interface, of the looks, or of a
/// task of your own.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
#[non_exhaustive]
pub enum Factor {
    /// A number of the physics.
    Physics(PhysicsFactor),
    /// A number of what lies between a policy and the robot.
    Interface(InterfaceFactor),
    /// A number of how pictures look.
    Look(LookFactor),
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
            Self::Interface(factor) => factor.name(),
            Self::Look(factor) => factor.name(),
            Self::Own(name) => name,
        }
    }

    /// Returns the smallest and the largest value.
    #[must_use]
    pub const fn bounds(&self) -> [f64; 2] {
        match self {
            Self::Physics(factor) => factor.bounds(),
            Self::Interface(factor) => factor.bounds(),
            Self::Look(factor) => factor.bounds(),
            Self::Own(_) => [-LARGEST_NUMBER, LARGEST_NUMBER],
        }
    }

    /// Returns the names of all factors but a task's own.
    pub(super) fn names() -> impl Iterator<Item = &'static str> {
        let interface = InterfaceFactor::ALL.iter().map(|factor| factor.name());
        let looks = LookFactor::ALL.iter().map(|factor| factor.name());
        PhysicsFactor::ALL.iter().map(|factor| factor.name()).chain(interface).chain(looks)
    }
}

impl fmt::Display for Factor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl From<InterfaceFactor> for Factor {
    fn from(factor: InterfaceFactor) -> Self {
        Self::Interface(factor)
    }
}

impl From<LookFactor> for Factor {
    fn from(factor: LookFactor) -> Self {
        Self::Look(factor)
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
        if let Ok(factor) = name.parse() {
            return Self::Physics(factor);
        }
        if let Ok(factor) = name.parse() {
            return Self::Look(factor);
        }
        let mut interface = InterfaceFactor::ALL.iter();
        match interface.find(|factor| factor.name() == name) {
            Some(&factor) => Self::Interface(factor),
            None => Self::Own(name.into()),
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
