//! Which transitions of a buffer come from demonstrations.

use std::ops::Range;

use her_relabel::{HerBuffer, TransitionId};
use serde::{Deserialize, Serialize};

/// The demonstrated transitions of a buffer, by their numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Demonstrated {
    /// In ascending order, without overlaps.
    ranges: Vec<Range<u64>>,
    /// The number of transitions that the normalizers have not taken in.
    pub(crate) unseen: u64,
}

impl Demonstrated {
    /// Whether a transition is demonstrated.
    pub(crate) fn contains(&self, id: TransitionId) -> bool {
        let after = self.ranges.partition_point(|range| range.start <= id.get());
        after > 0 && id.get() < self.ranges[after - 1].end
    }

    /// Adds the transitions of a buffer that are newer than `newest`, or all if it is `None`.
    pub(crate) fn add(&mut self, buffer: &HerBuffer<f32>, newest: Option<TransitionId>) {
        let Some((oldest, last)) = buffer.transition_ids() else { return };
        let start = newest.map_or(0, |newest| newest.get() + 1).max(oldest.get());
        let added = start..last.get() + 1;
        self.unseen += added.end.saturating_sub(added.start);
        self.push(added);
    }

    /// Adds the demonstrated transitions of another buffer, whose newest transition is `others`,
    /// after its episodes were appended to a buffer, whose newest transition is now `own`.
    pub(crate) fn append(&mut self, other: &Self, others: TransitionId, own: TransitionId) {
        // Transitions keep their distance from the newest.
        let moved = |number: u64| {
            let distance = others.get().saturating_add(1).saturating_sub(number);
            own.get().saturating_add(1).saturating_sub(distance)
        };
        for range in &other.ranges {
            self.push(moved(range.start)..moved(range.end));
        }
        self.unseen = self.unseen.saturating_add(other.unseen);
    }

    fn push(&mut self, range: Range<u64>) {
        let end = self.ranges.last().map_or(0, |last| last.end);
        let range = range.start.max(end)..range.end;
        match self.ranges.last_mut() {
            _ if range.is_empty() => {}
            Some(last) if last.end == range.start => last.end = range.end,
            _ => self.ranges.push(range),
        }
    }
}
