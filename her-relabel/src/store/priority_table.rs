//! The priorities of stored transitions or episodes.

use std::ops::Range;

use crate::store::episodes::Episodes;
use crate::store::priorities::{NewPriority, Priorities, PriorityUnit};
use crate::store::sum_tree::SumTree;

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

    /// Updates the table after episodes were added or dropped.
    pub(crate) fn follow(&mut self, episodes: &Episodes) {
        let priority = match self.settings.new_priority() {
            NewPriority::Highest => self.highest,
            NewPriority::Given(priority) => priority,
        };
        self.tree.slide(self.settings.unit().live(episodes), priority);
    }

    /// Forgets all priorities, after all episodes were dropped.
    pub(crate) fn clear(&mut self, episodes: &Episodes) {
        *self = Self::new(self.settings);
        self.follow(episodes);
    }

    /// Sets the priority of a live transition, or of its episode.
    pub(crate) fn set(&mut self, episodes: &Episodes, transition: u64, priority: f64) {
        self.highest = self.highest.max(priority);
        self.tree.set(self.number(episodes, transition), priority);
    }

    /// Returns the priority of a live transition, or of its episode.
    pub(crate) fn priority(&self, episodes: &Episodes, transition: u64) -> f64 {
        self.tree.weight(self.number(episodes, transition))
    }

    /// Returns the number of the unit that a live transition is or belongs to.
    fn number(&self, episodes: &Episodes, transition: u64) -> u64 {
        match self.settings.unit() {
            PriorityUnit::Transition => transition,
            PriorityUnit::Episode => episodes.of(transition).number,
        }
    }
}

impl PriorityUnit {
    /// Returns the numbers of all live units.
    pub(crate) fn live(self, episodes: &Episodes) -> Range<u64> {
        match self {
            Self::Transition => episodes.live(),
            Self::Episode => episodes.numbers(),
        }
    }
}
