//! Which episode a transition belongs to.

use std::ops::Range;

use crate::draws::below;
use crate::queue::Queue;

/// Transitions are numbered in the order in which they were stored, and so are episodes. A cell is
/// a run of this many transition numbers, as a power of two.
const CELL_SHIFT: u32 = 6;

/// The stored episodes, in order: a map from transitions to episodes that takes a fraction of a byte
/// for each transition and finds an episode among the few that share a cell.
#[derive(Clone, Debug, Default)]
pub(crate) struct Episodes {
    /// The transitions that are live.
    live: Range<u64>,
    records: Queue<Record>,
    /// The number of the first record.
    first_episode: u64,
    /// For every cell, the episode of the cell's first transition.
    cells: Queue<u64>,
    first_cell: u64,
}

/// How an episode ended. At least one is true.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ending {
    pub(crate) terminated: bool,
    pub(crate) truncated: bool,
}

/// The first transition that was stored of an episode, live or not, and how the episode ended, in one
/// word: 62 bits of transition number are more than a computer can count up to.
#[derive(Clone, Copy, Debug)]
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
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Episode {
    pub(crate) number: u64,
    /// Its live transitions.
    pub(crate) live: Range<u64>,
    pub(crate) ending: Ending,
}

impl Episode {
    /// The row of the state in which transition `transition` of this episode starts. Every earlier
    /// episode has one row more than it has transitions.
    #[inline(always)]
    pub(crate) fn row(&self, transition: u64) -> u64 {
        transition + self.number
    }

    /// The row of the episode's last state.
    #[inline(always)]
    pub(crate) fn last_row(&self) -> u64 {
        self.row(self.live.end)
    }
}

impl Episodes {
    /// What [`records`](Self::records) gave, if that describes episodes with these live transitions.
    pub(crate) fn restore(live: Range<u64>, first_episode: u64, records: &[u64]) -> Option<Self> {
        let Range { start, end } = live;
        let is_amid_cell = !start.is_multiple_of(1 << CELL_SHIFT);
        let mut episodes = Self {
            live: start..start,
            first_episode,
            first_cell: start >> CELL_SHIFT,
            ..Self::default()
        };
        // The cell that begins before the live transitions.
        episodes.cells.extend(is_amid_cell.then_some(first_episode));
        for (at, record) in records.iter().map(|record| Record(*record)).enumerate() {
            let next = records.get(at + 1).map_or(end, |record| Record(*record).first());
            // Only the first episode may have lost transitions.
            let begins = if at == 0 { record.first() <= start } else { record.first() > start };
            let Ending { terminated, truncated } = record.ending();
            let ends = episodes.live.end < next && next <= end && (terminated || truncated);
            if !(begins && ends) {
                return None;
            }
            let cells = episodes.live.end.div_ceil(1 << CELL_SHIFT)..next.div_ceil(1 << CELL_SHIFT);
            episodes.cells.extend(cells.map(|_| first_episode + at as u64));
            episodes.records.push(record);
            episodes.live.end = next;
        }
        (episodes.live.end == end).then_some(episodes)
    }

    /// The episodes, each in one word.
    pub(crate) fn records(&self) -> impl Iterator<Item = u64> + '_ {
        self.records.iter().map(|record| record.0)
    }

    /// The numbers of the live transitions.
    #[inline(always)]
    pub(crate) fn live(&self) -> Range<u64> {
        self.live.clone()
    }

    /// The numbers of the episodes of which a transition is live.
    pub(crate) fn numbers(&self) -> Range<u64> {
        self.first_episode..self.first_episode + self.records.len() as u64
    }

    /// The number of episodes of which a transition is live.
    pub(crate) fn len(&self) -> usize {
        self.records.len()
    }

    /// Appends an episode of `len` transitions, at least 1.
    pub(crate) fn push(&mut self, len: u64, ending: Ending) {
        debug_assert!(len > 0);
        let first = self.live.end;
        let number = self.first_episode + self.records.len() as u64;
        self.records.push(Record::new(first, ending));
        self.live.end += len;
        let cells = first.div_ceil(1 << CELL_SHIFT)..self.live.end.div_ceil(1 << CELL_SHIFT);
        self.cells.extend(cells.map(|_| number));
    }

    /// Lets go of the transitions below `start` and returns the first row that is still needed.
    pub(crate) fn drop_before(&mut self, start: u64) -> u64 {
        debug_assert!(start <= self.live.end);
        let start = self.live.start.max(start);
        self.live.start = start;
        while !self.records.is_empty() {
            let next = self.records.get(1).map_or(self.live.end, |record| record.first());
            if next > start {
                break;
            }
            self.records.pop_front();
            self.first_episode += 1;
        }
        while !self.cells.is_empty() && (self.first_cell + 1) << CELL_SHIFT <= start {
            self.cells.pop_front();
            self.first_cell += 1;
        }
        start + self.first_episode
    }

    /// A live transition, each with the same probability, from a random word. At least one must live.
    #[inline(always)]
    pub(crate) fn pick(&self, word: u64) -> u64 {
        self.live.start + below(word, self.live.end - self.live.start)
    }

    /// [`pick`](Self::pick) as a function.
    #[inline(always)]
    pub(crate) fn picker(&self) -> impl Fn(u64) -> u64 + Copy {
        |word| self.pick(word)
    }

    /// The episode of a live transition.
    #[inline(always)]
    pub(crate) fn of(&self, transition: u64) -> Episode {
        debug_assert!(self.live.contains(&transition));
        let (cells, records) = (&self.cells[..], &self.records[..]);
        let cell = ((transition >> CELL_SHIFT) - self.first_cell) as usize;
        // The cell's first transition may lie in an episode that is gone.
        let mut at = cells[cell].saturating_sub(self.first_episode) as usize;
        let last = records.len() - 1;
        // Two episodes on without a branch that could be mispredicted: seldom do more begin in a cell.
        for _ in 0..2 {
            let next = (at + 1).min(last);
            at = if records[next].first() <= transition { next } else { at };
        }
        let is_after = |at: usize| records.get(at).is_none_or(|r| r.first() > transition);
        if !is_after(at + 1) {
            let mut beyond = match cells.get(cell + 1) {
                Some(episode) => (episode - self.first_episode) as usize + 1,
                None => self.records.len(),
            };
            while beyond - at > 1 {
                let middle = usize::midpoint(at, beyond);
                if is_after(middle) {
                    beyond = middle;
                } else {
                    at = middle;
                }
            }
        }
        self.at(at)
    }

    /// The episode with this number, of which a transition must be live.
    pub(crate) fn get(&self, number: u64) -> Episode {
        self.at((number - self.first_episode) as usize)
    }

    #[inline(always)]
    fn at(&self, at: usize) -> Episode {
        let records = &self.records[..];
        let record = records[at];
        let end = records.get(at + 1).map_or(self.live.end, |record| record.first());
        Episode {
            number: self.first_episode + at as u64,
            live: record.first().max(self.live.start)..end,
            ending: record.ending(),
        }
    }
}
