//! How a number is chosen for each episode.

use std::{ops::RangeInclusive, str::FromStr};

use serde::{Deserialize, Serialize};

use super::error::VariationError;
use crate::gym::np_random::NpRandom;

/// How a number is chosen for each episode.
///
/// A number converts into [`Fixed`](Self::Fixed), and a range into [`Uniform`](Self::Uniform).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Draw {
    /// Always the same number.
    Fixed(f64),
    /// Evenly between two numbers.
    Uniform(f64, f64),
    /// Between two positive numbers, with an even logarithm: as often from 0.5 to 1 as from 1 to 2.
    LogUniform(f64, f64),
    /// One of these numbers, each equally often.
    Choice(Vec<f64>),
}

impl Draw {
    pub(super) fn check(
        &self,
        factor: &str,
        [least, most]: [f64; 2],
    ) -> Result<(), VariationError> {
        let factor = || factor.to_owned();
        let numbers = match self {
            Self::Fixed(value) => &[*value][..],
            Self::Uniform(low, high) | Self::LogUniform(low, high) => &[*low, *high],
            Self::Choice(values) => values,
        };
        if let Some(&value) = numbers.iter().find(|&value| !(least..=most).contains(value)) {
            return Err(VariationError::OutOfRange { factor: factor(), value, least, most });
        }
        match *self {
            Self::Choice(ref values) if values.is_empty() => {
                Err(VariationError::NoChoice { factor: factor() })
            }
            Self::LogUniform(low, _) if low <= 0.0 => {
                Err(VariationError::NoLogarithm { factor: factor(), low })
            }
            Self::Uniform(low, high) | Self::LogUniform(low, high) if low > high => {
                Err(VariationError::Reversed { factor: factor(), low, high })
            }
            _ => Ok(()),
        }
    }

    pub(super) fn draw(&self, random: &mut NpRandom) -> f64 {
        match self {
            Self::Fixed(value) => *value,
            // Rounding must not leave the range.
            Self::Uniform(low, high) => random.uniform(*low, *high).clamp(*low, *high),
            Self::LogUniform(low, high) => {
                let exponent = random.uniform(libm::log(*low), libm::log(*high));
                libm::exp(exponent).clamp(*low, *high)
            }
            Self::Choice(values) => {
                let at = (random.random() * values.len() as f64) as usize;
                values[at.min(values.len() - 1)]
            }
        }
    }
}

/// Reads a draw as a command line has it: `0.02`, `0.5..4`, `log:0.5..4`, or a choice such as
/// `0,1,2`.
impl FromStr for Draw {
    type Err = VariationError;

    fn from_str(text: &str) -> Result<Self, VariationError> {
        let unreadable = |_| VariationError::Unreadable { text: text.into() };
        let number = |number: &str| number.trim().parse::<f64>().map_err(unreadable);
        let (is_even, range) = match text.strip_prefix("log:") {
            Some(range) => (false, range),
            None => (true, text),
        };
        match range.split_once("..") {
            Some((low, high)) if is_even => Ok(Self::Uniform(number(low)?, number(high)?)),
            Some((low, high)) => Ok(Self::LogUniform(number(low)?, number(high)?)),
            None if text.contains(',') => {
                Ok(Self::Choice(text.split(',').map(number).collect::<Result<_, _>>()?))
            }
            None => Ok(Self::Fixed(number(text)?)),
        }
    }
}

impl From<f64> for Draw {
    fn from(value: f64) -> Self {
        Self::Fixed(value)
    }
}

impl From<RangeInclusive<f64>> for Draw {
    fn from(range: RangeInclusive<f64>) -> Self {
        let (low, high) = range.into_inner();
        Self::Uniform(low, high)
    }
}
