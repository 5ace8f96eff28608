//! Settings of priorities, and the error of setting them.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The largest priority, far below where sums would overflow.
const MAX_PRIORITY: f64 = 1e200;

/// Settings of a buffer's priorities, for a [prioritized](crate::Sampler::with_priorities)
/// [`Sampler`](crate::Sampler).
///
/// Priorities take 9 to 18 bytes per transition, or per episode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Priorities {
    unit: PriorityUnit,
    #[serde(default)]
    new_priority: NewPriority,
}

impl Priorities {
    /// Creates settings that give every `unit` a priority.
    #[must_use]
    pub const fn new(unit: PriorityUnit) -> Self {
        Self { unit, new_priority: NewPriority::Highest }
    }

    settings! {
        /// Sets the priority of new units. The default, [`NewPriority::Highest`], is the paper's.
        with_new_priority(new_priority: NewPriority);

        /// Returns the unit that has a priority.
        unit: PriorityUnit;
        /// Returns the priority of new units.
        new_priority: NewPriority;
    }
}

/// The unit that has a priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PriorityUnit {
    /// Every transition, drawn in proportion to its priority.
    ///
    /// Source: Schaul et al., *Prioritized experience replay*, 2016.
    Transition,
    /// Every episode, drawn in proportion to its priority; then one of its transitions is drawn
    /// uniformly.
    ///
    /// Source: Zhao and Tresp, *Energy-based hindsight experience prioritization*, 2018.
    Episode,
}

/// The priority of new transitions or episodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NewPriority {
    /// The default: the highest priority set so far, and at least 1, so that new transitions are soon
    /// drawn.
    #[default]
    Highest,
    /// A fixed priority, from 0 to 1e200.
    Given(f64),
}

/// Error returned for priorities that cannot be set. The buffer is unchanged.
#[derive(Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PriorityError {
    /// The buffer has no priorities.
    #[error("the buffer has no priorities: configure them with `BufferConfig::with_priorities`")]
    NoPriorities,
    /// The numbers of transitions and priorities differ.
    #[error("{priorities} priorities were given for {transitions} transitions: pass one for each")]
    WrongLength {
        /// The number of transitions.
        transitions: usize,
        /// The number of priorities.
        priorities: usize,
    },
    /// A priority is negative, NaN, infinite or enormous.
    #[error("priority {index} is {priority}: use a finite number from 0 to 1e200")]
    BadPriority {
        /// Its place in the list.
        index: usize,
        /// The priority.
        priority: f64,
    },
    /// A transition was never stored in this buffer.
    #[error("transition {number} was never stored here: pass transitions drawn from this buffer")]
    UnknownTransition {
        /// The number of the transition.
        number: u64,
    },
}
debug_as_display!(PriorityError);

/// Returns whether a number is a valid priority.
pub(crate) fn is_priority(priority: f64) -> bool {
    (0.0..=MAX_PRIORITY).contains(&priority)
}
