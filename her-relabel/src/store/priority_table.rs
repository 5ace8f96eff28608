//! How likely stored transitions are to be drawn.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::sample::draws::{Draws, Purpose, below, unit};
use crate::store::episodes::Episodes;
use crate::store::storage::TransitionId;
use crate::store::sum_tree::SumTree;
use crate::{ConfigError, HerBuffer, Scalar};

/// Far from where sums would overflow.
const MAX_PRIORITY: f64 = 1e200;

/// Priorities of what a buffer stores, for a [`Sampler`](crate::Sampler) that is
/// [prioritized](crate::Sampler::with_priorities).
///
/// They take 9 to 18 bytes for each transition, or for each episode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Priorities {
    /// What has a priority.
    pub unit: PriorityUnit,
    /// The priority of what is added.
    pub new: NewPriority,
}

/// What has a priority of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PriorityUnit {
    /// Every transition, which is drawn in proportion to it.
    ///
    /// Source: Schaul et al., *Prioritized experience replay*, 2016.
    Transition,
    /// Every episode, which is drawn in proportion to it, and then one of its transitions, all with the
    /// same probability.
    ///
    /// Source: Zhao and Tresp, *Energy-based hindsight experience prioritization*, 2018.
    Episode,
}

/// The priority of what is added.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NewPriority {
    /// The highest priority that was set so far, and 1 at least: what is new is soon drawn.
    Highest,
    /// This one, finite and from 0 to 1e200.
    Given(f64),
}

/// Priorities that cannot be set. The buffer is as it was before the call.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PriorityError {
    /// The buffer has no priorities.
    #[error("this buffer has no priorities; set `priorities` of its configuration")]
    NoPriorities,
    /// There is not one priority for each transition.
    #[error("{priorities} priorities for {transitions} transitions; pass one for each")]
    WrongLength {
        /// The number of transitions.
        transitions: usize,
        /// The number of priorities.
        priorities: usize,
    },
    /// A priority is negative, NaN, infinite or enormous.
    #[error("priority {index} is {priority}; use a finite number from 0 to 1e200")]
    BadPriority {
        /// Its place in the list.
        index: usize,
        /// The priority.
        priority: f64,
    },
    /// A transition has never been stored.
    #[error("transition {number} has not been stored; it belongs to another buffer")]
    UnknownTransition {
        /// The number of the transition.
        number: u64,
    },
}

impl<T: Scalar> HerBuffer<T> {
    /// Sets the priorities of transitions, or of the episodes that they belong to; of several for the same
    /// one the last counts. Transitions that have been overwritten are ignored.
    ///
    /// A priority is the weight of a draw itself: prioritized replay of the paper passes
    /// `(|td_error| + epsilon).powf(alpha)`.
    ///
    /// # Errors
    /// [`PriorityError`].
    pub fn set_priorities<S: Scalar>(
        &mut self,
        transitions: &[TransitionId],
        priorities: &[S],
    ) -> Result<(), PriorityError> {
        let episodes = &self.storage.episodes;
        let table = self.storage.priorities.as_mut().ok_or(PriorityError::NoPriorities)?;
        let lens = (transitions.len(), priorities.len());
        if lens.0 != lens.1 {
            return Err(PriorityError::WrongLength { transitions: lens.0, priorities: lens.1 });
        }
        let is_bad = |priority: &S| !is_priority(priority.to_f64());
        if let Some(index) = priorities.iter().position(is_bad) {
            let priority = priorities[index].to_f64();
            return Err(PriorityError::BadPriority { index, priority });
        }
        let live = episodes.live();
        if let Some(id) = transitions.iter().find(|id| id.number() >= live.end) {
            return Err(PriorityError::UnknownTransition { number: id.get() });
        }
        let pairs = transitions.iter().zip(priorities);
        for (id, priority) in pairs.filter(|(id, _)| id.number() >= live.start) {
            table.set(episodes, id.number(), priority.to_f64());
        }
        Ok(())
    }

    /// The priority of a transition, or of its episode; `None` if it has been overwritten or the buffer has
    /// no priorities.
    #[must_use]
    pub fn priority(&self, transition: TransitionId) -> Option<f64> {
        let (episodes, number) = (&self.storage.episodes, transition.number());
        let table = self.storage.priorities.as_ref()?;
        episodes.live().contains(&number).then(|| table.priority(episodes, number))
    }
}

impl Priorities {
    pub(crate) fn check(self) -> Result<(), ConfigError> {
        match self.new {
            NewPriority::Given(priority) if !is_priority(priority) => {
                Err(ConfigError::BadPriority { priority })
            }
            _ => Ok(()),
        }
    }
}

pub(crate) fn is_priority(priority: f64) -> bool {
    (0.0..=MAX_PRIORITY).contains(&priority)
}

/// The priorities of the live transitions or episodes.
#[derive(Clone, Debug)]
pub(crate) struct PriorityTable {
    pub(crate) settings: Priorities,
    pub(crate) highest: f64,
    pub(crate) tree: SumTree,
}

impl PriorityTable {
    pub(crate) fn new(settings: Priorities) -> Self {
        Self { settings, highest: 1.0, tree: SumTree::new() }
    }

    /// Takes note of what has been added and dropped.
    pub(crate) fn follow(&mut self, episodes: &Episodes) {
        let new = match self.settings.new {
            NewPriority::Highest => self.highest,
            NewPriority::Given(priority) => priority,
        };
        self.tree.slide(self.settings.unit.live(episodes), new);
    }

    /// Forgets what was set; everything has been dropped.
    pub(crate) fn clear(&mut self, episodes: &Episodes) {
        *self = Self::new(self.settings);
        self.follow(episodes);
    }

    fn set(&mut self, episodes: &Episodes, transition: u64, priority: f64) {
        self.highest = self.highest.max(priority);
        self.tree.set(self.settings.unit.number(episodes, transition), priority);
    }

    fn priority(&self, episodes: &Episodes, transition: u64) -> f64 {
        self.tree.weight(self.settings.unit.number(episodes, transition))
    }

    /// A live transition, from a random word. Something must have a priority.
    #[inline]
    pub(crate) fn pick(&self, episodes: &Episodes, word: u64) -> u64 {
        let drawn = self.tree.draw(unit(word));
        match self.settings.unit {
            PriorityUnit::Transition => drawn,
            PriorityUnit::Episode => {
                let live = episodes.get(drawn).live();
                let another = Draws::new(word).word(0, Purpose::Transition);
                live.start + below(another, live.end - live.start)
            }
        }
    }

    /// [`pick`](Self::pick) as a function.
    pub(crate) fn picker(&self, episodes: &Episodes) -> impl Fn(u64) -> u64 + Copy {
        |word| self.pick(episodes, word)
    }

    /// What a live transition that was picked is drawn with, in proportion to its probability.
    pub(crate) fn share(&self, episodes: &Episodes, transition: u64) -> f64 {
        match self.settings.unit {
            PriorityUnit::Transition => self.tree.weight(transition),
            PriorityUnit::Episode => {
                let episode = episodes.of(transition);
                let len = (episode.end - episode.start) as f64;
                // Not even the least number may become 0.
                (self.tree.weight(episode.number) / len).max(f64::MIN_POSITIVE)
            }
        }
    }
}

impl PriorityUnit {
    /// The numbers of all that there are.
    pub(crate) fn live(self, episodes: &Episodes) -> std::ops::Range<u64> {
        match self {
            Self::Transition => episodes.live(),
            Self::Episode => episodes.numbers(),
        }
    }

    /// The number of the one that a live transition is or belongs to.
    fn number(self, episodes: &Episodes, transition: u64) -> u64 {
        match self {
            Self::Transition => transition,
            Self::Episode => episodes.of(transition).number,
        }
    }
}
