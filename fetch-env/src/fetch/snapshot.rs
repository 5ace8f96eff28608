use fetch_sim::SimConfig;
use serde::{Deserialize, Serialize};

use crate::{EnvError, NpRandom};

/// The complete state of a [`FetchEnv`](crate::FetchEnv): the simulation, the goal and the random
/// numbers.
///
/// `S` is the simulator's own snapshot. Formats that write every bit of a number keep it exact: with
/// serde_json, switch its feature `float_roundtrip` on. It fits every environment whose simulator
/// was made the same way (task, model, number of substeps), whatever the rewards and ranges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FetchSnapshot<S> {
    pub(crate) sim: SimConfig,
    pub(crate) simulator: S,
    pub(crate) random: Option<NpRandom>,
    pub(crate) goal: Option<[f64; 3]>,
}

impl<S> FetchSnapshot<S> {
    pub(crate) fn check(&self, sim: &SimConfig) -> Result<(), EnvError> {
        let foreign = |reason| Err(EnvError::ForeignSnapshot { reason });
        if self.sim.task != sim.task {
            return foreign(format!("it is of {}, this is {}", self.sim.task, sim.task));
        }
        if self.sim.n_substeps != sim.n_substeps {
            let (theirs, ours) = (self.sim.n_substeps, sim.n_substeps);
            return foreign(format!("it was taken with {theirs} substeps, these are {ours}"));
        }
        if self.goal.is_some_and(|goal| !goal.iter().all(|element| element.is_finite())) {
            return foreign(format!("its goal {:?} is not finite", self.goal));
        }
        if self.goal.is_some() && self.random.is_none() {
            return foreign("it has a goal but no random numbers".into());
        }
        Ok(())
    }
}
