//! The stored episodes, and the map from transitions to them.

use std::ops::Range;

use prefetch_index::prefetch_index;

use crate::store::queue::Queue;

/// The binary logarithm of the number of transitions in a cell, which is a run of consecutive
/// transition numbers. Transitions and episodes are numbered in the order in which they were
/// stored.
const CELL_SHIFT: u32 = 6;

/// The stored episodes, in order, and a map from transitions to episodes. It takes a fraction of a
/// byte per transition, and finds an episode among the few that share a cell.
#[derive(Clone, Debug)]
pub(crate) struct Episodes {
    /// The live transitions.
    live: Range<u64>,
    /// One record per episode, and one for the next episode, which begins where the last one ends.
    records: Queue<Record>,
    /// The number of the first record.
    first_episode: u64,
    /// The episode of each cell's first transition.
    cells: Queue<u64>,
    first_cell: u64,
    /// The steps of the longest episode so far.
    longest: u64,
}

/// The end of an episode. At least one flag is set, except for the next episode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Ending {
    pub(crate) terminated: bool,
    pub(crate) truncated: bool,
}

/// The first stored transition of an episode, live or not, and the episode's end, in one word: no
/// computer counts beyond 62 bits of transition number.
#[derive(Clone, Copy, Debug, Default)]
struct Record(u64);

impl Record {
    fn new(first: u64, ending: Ending) -> Self {
        Self(first << 2 | u64::from(ending.terminated) << 1 | u64::from(ending.truncated))
    }

    #[inline(always)]
    fn first(self) -> u64 {
        self.0 >> 2
    }

    #[inline(always)]
    fn ending(self) -> Ending {
        Ending { terminated: self.0 & 2 != 0, truncated: self.0 & 1 != 0 }
    }
}

/// A stored episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Episode {
    pub(crate) number: u64,
    /// The first live transition, and the one after the last.
    pub(crate) start: u64,
    pub(crate) end: u64,
    pub(crate) ending: Ending,
}

impl Episode {
    /// Returns the live transitions.
    pub(crate) fn live(&self) -> Range<u64> {
        self.start..self.end
    }

    /// Returns the row of the state in which transition `transition` of this episode starts. Every
    /// earlier episode has one more row than transitions.
    #[inline(always)]
    pub(crate) fn row(&self, transition: u64) -> u64 {
        transition + self.number
    }

    /// Returns the row of the episode's last state.
    #[inline(always)]
    pub(crate) fn last_row(&self) -> u64 {
        self.row(self.end)
    }
}

impl Episodes {
    /// Creates an empty list, whose first episode gets the number `first_episode` and whose first
    /// transition gets `transition`.
    pub(crate) fn new(first_episode: u64, transition: u64) -> Self {
        let mut records = Queue::default();
        records.push(Record::new(transition, Ending::default()));
        Self {
            live: transition..transition,
            records,
            first_episode,
            cells: Queue::default(),
            first_cell: transition >> CELL_SHIFT,
            longest: 0,
        }
    }

    /// Restores episodes from their [`records`](Self::records), if these fit the live transitions.
    pub(crate) fn restore(live: Range<u64>, first_episode: u64, records: &[u64]) -> Option<Self> {
        let Range { start, end } = live;
        let is_within_cell = !start.is_multiple_of(1 << CELL_SHIFT);
        let mut episodes = Self::new(first_episode, start);
        // The cell that begins before the live transitions.
        episodes.cells.extend(is_within_cell.then_some(first_episode));
        for (at, record) in records.iter().map(|record| Record(*record)).enumerate() {
            let next = records.get(at + 1).map_or(end, |record| Record(*record).first());
            // The first episode may have lost transitions. The others begin where the one before
            // them ends.
            let begins = at > 0 || record.first() <= start;
            let ending = record.ending();
            let ends = episodes.live.end < next && next <= end && ending != Ending::default();
            if !(begins && ends) {
                return None;
            }
            episodes.push(next - episodes.live.end, ending);
            episodes.records[at] = record;
        }
        (episodes.live.end == end).then_some(episodes)
    }

    /// Returns the records of the episodes, one word each.
    pub(crate) fn records(&self) -> impl Iterator<Item = u64> + '_ {
        self.records[..self.len()].iter().map(|record| record.0)
    }

    /// Returns the numbers of the live transitions.
    #[inline(always)]
    pub(crate) fn live(&self) -> Range<u64> {
        self.live.clone()
    }

    /// Returns the episodes with a live transition, in order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = Episode> + '_ {
        (0..self.len()).map(|at| self.at(at))
    }

    /// Returns the numbers of the episodes with a live transition.
    pub(crate) fn numbers(&self) -> Range<u64> {
        self.first_episode..self.first_episode + self.len() as u64
    }

    /// Returns the number of episodes with a live transition.
    pub(crate) fn len(&self) -> usize {
        self.records.len() - 1
    }

    /// Returns an upper bound on the number of steps of every episode.
    pub(crate) fn longest(&self) -> u64 {
        self.longest
    }

    /// Appends an episode of `len` transitions, at least 1.
    pub(crate) fn push(&mut self, len: u64, ending: Ending) {
        debug_assert!(len > 0);
        let (first, at) = (self.live.end, self.len());
        self.live.end += len;
        self.longest = self.longest.max(len);
        self.records[at] = Record::new(first, ending);
        self.records.push(Record::new(self.live.end, Ending::default()));
        let cells = first.div_ceil(1 << CELL_SHIFT)..self.live.end.div_ceil(1 << CELL_SHIFT);
        self.cells.extend(cells.map(|_| self.first_episode + at as u64));
    }

    /// Drops the transitions below `start` and returns the first row that is still needed.
    pub(crate) fn drop_before(&mut self, start: u64) -> u64 {
        debug_assert!(start <= self.live.end);
        let start = self.live.start.max(start);
        self.live.start = start;
        while self.len() > 0 && self.records[1].first() <= start {
            self.records.pop_front();
            self.first_episode += 1;
        }
        while !self.cells.is_empty() && (self.first_cell + 1) << CELL_SHIFT <= start {
            self.cells.pop_front();
            self.first_cell += 1;
        }
        start + self.first_episode
    }

    /// Prefetches what [`prefetch_record`](Self::prefetch_record) reads.
    #[inline(always)]
    pub(crate) fn prefetch_cell(&self, transition: u64) {
        prefetch_index(&self.cells[..], self.cell(transition));
    }

    /// Prefetches the record that [`of`](Self::of) reads.
    #[inline(always)]
    pub(crate) fn prefetch_record(&self, transition: u64) {
        prefetch_index(&self.records[..], self.first_in(self.cell(transition)));
    }

    #[inline(always)]
    fn cell(&self, transition: u64) -> usize {
        ((transition >> CELL_SHIFT) - self.first_cell) as usize
    }

    /// Returns the place of the episode of a cell's first transition.
    #[inline(always)]
    fn first_in(&self, cell: usize) -> usize {
        // The episode may have been dropped.
        self.cells[cell].saturating_sub(self.first_episode) as usize
    }

    /// Returns the episode of a live transition.
    #[inline(always)]
    pub(crate) fn of(&self, transition: u64) -> Episode {
        debug_assert!(self.live.contains(&transition));
        let records = &self.records[..];
        let cell = self.cell(transition);
        let mut at = self.first_in(cell);
        // Two steps without a branch that could be mispredicted; more episodes rarely begin in a
        // cell.
        for _ in 0..2 {
            at += usize::from(records[at + 1].first() <= transition);
        }
        if records[at + 1].first() <= transition {
            at = self.search(cell, at, transition);
        }
        self.at(at)
    }

    /// Returns the place of the episode of a transition of this cell, somewhere after the place
    /// `at`.
    #[cold]
    fn search(&self, cell: usize, at: usize, transition: u64) -> usize {
        let last = match self.cells.get(cell + 1) {
            Some(episode) => (episode - self.first_episode) as usize,
            None => self.len() - 1,
        };
        let begun = |record: &Record| record.first() <= transition;
        at + self.records[at + 1..=last].partition_point(begun)
    }

    /// Returns the episode with this number, which must have a live transition.
    pub(crate) fn get(&self, number: u64) -> Episode {
        self.at((number - self.first_episode) as usize)
    }

    #[inline(always)]
    fn at(&self, at: usize) -> Episode {
        let [record, next] = [self.records[at], self.records[at + 1]];
        Episode {
            number: self.first_episode + at as u64,
            start: record.first().max(self.live.start),
            end: next.first(),
            ending: record.ending(),
        }
    }
}
