//! Keeping only a share of the episodes whose achieved goal hardly moved.

use serde::{Deserialize, Serialize};

use crate::unit_interval::UnitInterval;

/// Settings that keep only a share of the motionless episodes, in which the achieved goal stays
/// within a distance of the first one.
///
/// In tasks that move an object, most episodes of an untrained agent do not touch it. Every goal
/// achieved in such an episode is the same, so hindsight teaches nothing. Dropping most of them is
/// a bias: the buffer then overrates episodes that move something.
///
/// An episode is judged when it ends, by the Euclidean distance and the states that the buffer
/// would keep of it. A motionless episode is kept with the probability `kept`. The decision depends
/// only on the seed and on the number of episodes that ended before, so a loaded buffer decides as
/// the saved one would.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionlessEpisodes {
    max_distance: f64,
    kept: UnitInterval,
    #[serde(default)]
    seed: u64,
}

impl MotionlessEpisodes {
    /// Creates settings that keep the share `kept` of the episodes in which the achieved goal stays
    /// within `max_distance` of the first one, in the unit of the goals, finite and at least 0. For
    /// the Fetch tasks, 0.01 m and 0.1 work well.
    #[must_use]
    pub const fn new(max_distance: f64, kept: UnitInterval) -> Self {
        Self { max_distance, kept, seed: 0 }
    }

    settings! {
        /// Sets the seed of the decisions. The default is 0.
        with_seed(seed: u64);

        /// Returns the farthest distance of a motionless episode's goals from the first one.
        max_distance: f64;
        /// Returns the share of motionless episodes that is kept.
        kept: UnitInterval;
        /// Returns the seed of the decisions.
        seed: u64;
    }

    /// Returns whether the distance is finite and at least 0.
    pub(crate) fn is_valid(&self) -> bool {
        (0.0..f64::INFINITY).contains(&self.max_distance)
    }
}
