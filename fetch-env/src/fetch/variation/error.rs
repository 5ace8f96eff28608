//! Errors of a variation.

use fetch_sim::SimError;

/// Error returned for a [`Variation`](super::Variation) that an environment cannot draw.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VariationError {
    /// A number outside of what the factor can be.
    #[error("{factor} is {value:?}: pass numbers from {least} to {most}")]
    OutOfRange {
        /// The factor's name.
        factor: String,
        /// The number.
        value: f64,
        /// The smallest valid number.
        least: f64,
        /// The largest valid number.
        most: f64,
    },
    /// A range whose first number is the greater one.
    #[error("{factor} has the range from {low} to {high}: pass the smaller number first")]
    Reversed {
        /// The factor's name.
        factor: String,
        /// The first number.
        low: f64,
        /// The second number.
        high: f64,
    },
    /// A log-uniform range that does not start above 0.
    #[error("{factor} has a log-uniform range from {low}: start above 0, or use a uniform range")]
    NoLogarithm {
        /// The factor's name.
        factor: String,
        /// The smallest number of the range.
        low: f64,
    },
    /// A choice without values.
    #[error("{factor} has nothing to choose from: pass at least one number")]
    NoChoice {
        /// The factor's name.
        factor: String,
    },
    /// A factor that neither this crate nor the task has.
    #[error("there is no factor {name:?}: the nearest are {}", nearest.join(", "))]
    UnknownFactor {
        /// The name.
        name: String,
        /// The names of the environment's factors, the most similar ones.
        nearest: Vec<String>,
    },
    /// A text that is no [`Draw`](super::draw::Draw).
    #[error("cannot read {text:?}: write a number, 0.5..4, log:0.5..4, or a choice such as 0,1,2")]
    Unreadable {
        /// The text.
        text: String,
    },
    /// A number that the simulator cannot vary.
    #[error(transparent)]
    Sim(#[from] SimError),
}

debug_as_display!(VariationError);
