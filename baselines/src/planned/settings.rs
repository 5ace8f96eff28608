//! The settings of a planner.

use serde::{Deserialize, Serialize};

use super::error::PlannerError;

/// The settings of a [`Planner`](crate::Planner).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannerSettings {
    /// The seed of the candidates that are drawn: 0.
    pub seed: u64,
    /// The number of candidates of an iteration: 24. Range: 2 to 65,536.
    pub population: usize,
    /// The number of the best candidates so far, from which the next ones are drawn: 6. Range: 2 to
    /// the population.
    pub elites: usize,
    /// The largest number of iterations of a search: 20. Range: 0, for none, to 1,000,000.
    pub iterations: usize,
    /// The number of times at which an element of the action is drawn: 10, spread evenly over the
    /// steps, with linear interpolation between them. Range: 2 to 1,024.
    pub knots: usize,
    /// The standard deviation of the first candidates' actions around those of the best plan, as a
    /// share of the distance between the bounds of an action: 0.15. Range: above 0, at most 1.
    pub spread: f64,
    /// Whether a search continues after the first success, to find one in fewer steps: false.
    pub fewest_steps: bool,
}

impl Default for PlannerSettings {
    fn default() -> Self {
        Self {
            seed: 0,
            population: 24,
            elites: 6,
            iterations: 20,
            knots: 10,
            spread: 0.15,
            fewest_steps: false,
        }
    }
}

impl PlannerSettings {
    /// Checks that each setting is in its range.
    pub(super) fn check(&self) -> Result<(), PlannerError> {
        let check = |is_within, name, value, expected| {
            if is_within { Ok(()) } else { Err(PlannerError::Setting { name, value, expected }) }
        };
        let Self { population, elites, iterations, knots, spread, .. } = *self;
        let (text, range) = (population.to_string(), 2..=65_536);
        check(range.contains(&population), "population", text, "choose from 2 to 65536")?;
        let (text, range) = (elites.to_string(), 2..=population);
        check(range.contains(&elites), "elites", text, "choose from 2 to the population")?;
        let (text, range) = (iterations.to_string(), 0..=1_000_000);
        check(range.contains(&iterations), "iterations", text, "choose from 0 to 1000000")?;
        let (text, range) = (knots.to_string(), 2..=1_024);
        check(range.contains(&knots), "knots", text, "choose from 2 to 1024")?;
        let is_share = spread > 0.0 && spread <= 1.0;
        check(is_share, "spread", spread.to_string(), "choose a number above 0 and at most 1")
    }
}
