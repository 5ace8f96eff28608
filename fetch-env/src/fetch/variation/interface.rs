//! The factors of what lies between a policy and the robot.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::error::VariationError;

/// Declares the factors, with their names and bounds.
macro_rules! factors {
    ($($(#[$doc:meta])* $factor:ident = $name:literal, [$least:literal, $most:expr];)*) => {
        /// A factor of what lies between a policy and the robot.
        ///
        /// An action goes through the low pass, is scaled, gets noise, is clipped as always, and is
        /// delayed. At its neutral value, which each factor names, a stage changes nothing.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum InterfaceFactor {
            $($(#[$doc])* $factor,)*
        }

        impl InterfaceFactor {
            /// All factors.
            pub const ALL: &[Self] = &[$(Self::$factor),*];

            /// Returns the factor's name, such as `action_noise`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$factor => $name,)* }
            }

            /// Returns the smallest and the largest value.
            #[must_use]
            pub const fn bounds(self) -> [f64; 2] {
                match self { $(Self::$factor => [$least, $most],)* }
            }
        }
    };
}

/// The largest delay of actions, in steps.
const MAX_DELAY: f64 = 50.0;

factors! {
    /// `action_low_pass`: the share a of an action in what comes of it, a * action + (1 - a) * what
    /// came of the last one. The first action passes as it is, and so do all at 1.
    ActionLowPass = "action_low_pass", [1e-3, 1.0];
    /// `action_scale`: a factor of each element of an action. 1 leaves it.
    ActionScale = "action_scale", [0.0, 1e2];
    /// `action_noise`: the standard deviation of normal noise that is added to each element of an
    /// action. None at 0.
    ActionNoise = "action_noise", [0.0, 1e2];
    /// `action_delay`: the number of steps, up to 50, by which actions are delayed. What is drawn is
    /// rounded. Until the first action arrives, the robot holds its position. None at 0.
    ActionDelay = "action_delay", [0.0, MAX_DELAY];
    /// `observation_noise`: the standard deviation of normal noise that is added to each element of
    /// `observation`, in its unit. The goals, and so the rewards, stay exact. None at 0.
    ObservationNoise = "observation_noise", [0.0, 1e2];
}

/// The numbers of an interface that differ from the plain one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BTreeMap<String, f64>", into = "BTreeMap<String, f64>")]
pub(in crate::fetch) struct InterfaceNumbers([Option<f64>; InterfaceFactor::ALL.len()]);

impl InterfaceNumbers {
    pub(super) const fn set(&mut self, factor: InterfaceFactor, value: f64) {
        self.0[factor as usize] = Some(value);
    }

    pub(super) const fn get(&self, factor: InterfaceFactor) -> Option<f64> {
        self.0[factor as usize]
    }

    /// Returns a number, or the one that changes nothing.
    pub(in crate::fetch) fn or(&self, factor: InterfaceFactor, nothing: f64) -> f64 {
        self.get(factor).unwrap_or(nothing)
    }

    /// Returns the delay of actions, in steps.
    pub(in crate::fetch) fn action_delay(&self) -> usize {
        self.or(InterfaceFactor::ActionDelay, 0.0) as usize
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (InterfaceFactor, f64)> + '_ {
        InterfaceFactor::ALL.iter().filter_map(|&factor| Some((factor, self.get(factor)?)))
    }
}

impl From<InterfaceNumbers> for BTreeMap<String, f64> {
    fn from(numbers: InterfaceNumbers) -> Self {
        numbers.iter().map(|(factor, value)| (factor.name().to_owned(), value)).collect()
    }
}

impl TryFrom<BTreeMap<String, f64>> for InterfaceNumbers {
    type Error = VariationError;

    fn try_from(named: BTreeMap<String, f64>) -> Result<Self, VariationError> {
        let mut numbers = Self::default();
        for (name, value) in named {
            let mut factors = InterfaceFactor::ALL.iter().copied();
            let factor = factors.find(|factor| factor.name() == name);
            let factor = factor.ok_or_else(|| VariationError::UnknownFactor {
                name: name.clone(),
                nearest: InterfaceFactor::ALL.iter().map(|factor| factor.name().into()).collect(),
            })?;
            let [least, most] = factor.bounds();
            if !(least..=most).contains(&value) {
                return Err(VariationError::OutOfRange { factor: name, value, least, most });
            }
            numbers.set(factor, value);
        }
        Ok(numbers)
    }
}
