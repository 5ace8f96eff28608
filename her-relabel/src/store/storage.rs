//! The finished episodes of a buffer.

use std::num::NonZeroU64;

use crate::store::config::Layout;
use crate::store::episodes::{Ending, Episodes};
use crate::store::fields::Fields;
use crate::store::priority_table::{Priorities, PriorityTable};
use crate::store::tape::Tape;
use crate::{BufferConfig, ConfigError, Scalar};

/// The number of a stored transition. Numbers rise in the order of storing and are never used
/// again, not even after [`HerBuffer::clear`](crate::HerBuffer::clear). The transitions of an episode have consecutive
/// numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TransitionId(NonZeroU64);

impl TransitionId {
    /// The number, at least 1.
    #[inline]
    #[must_use]
    pub const fn get(self) -> u64 {
        self.0.get()
    }

    /// The identity of the transition that the buffer counts as `number`, from 0.
    #[inline(always)]
    pub(crate) fn of(number: u64) -> Self {
        Self(NonZeroU64::MIN.saturating_add(number))
    }

    /// [`of`](Self::of) if `is_some`, without a branch.
    #[inline(always)]
    pub(crate) fn of_if(number: u64, is_some: bool) -> Option<Self> {
        NonZeroU64::new((number + 1) * u64::from(is_some)).map(Self)
    }

    /// The number that the buffer counts the transition as, from 0.
    #[inline(always)]
    pub(crate) fn number(self) -> u64 {
        self.get() - 1
    }
}

/// The newest `capacity` transitions of finished episodes.
#[derive(Clone, Debug)]
pub(crate) struct Storage<T> {
    pub(crate) layout: Layout,
    pub(crate) fields: Fields,
    pub(crate) capacity: usize,
    pub(crate) episodes: Episodes,
    pub(crate) tape: Tape<T>,
    pub(crate) priorities: Option<PriorityTable>,
}

impl<T: Scalar> Storage<T> {
    pub(crate) fn new(config: &BufferConfig) -> Result<Self, ConfigError> {
        let layout = Layout::new::<T>(config)?;
        config.priorities.map_or(Ok(()), Priorities::check)?;
        Ok(Self {
            layout,
            fields: Fields::new(&config.fields)?,
            capacity: config.capacity,
            episodes: Episodes::default(),
            tape: Tape::new(layout.row(), config.capacity),
            priorities: config.priorities.map(PriorityTable::new),
        })
    }

    /// Adds the rows of an episode of 1 to `capacity` transitions, and drops what it pushes out.
    pub(crate) fn push_episode(&mut self, rows: &[T], ending: Ending) {
        let steps = (rows.len() / self.layout.row() - 1) as u64;
        let kept = self.capacity as u64 - steps;
        let live = self.episodes.live();
        // Room is made first, so that the tape can use it again.
        self.drop_before(live.end.saturating_sub(kept));
        self.tape.push_rows(rows);
        self.episodes.push(steps, ending);
        if let Some(table) = &mut self.priorities {
            table.follow(&self.episodes);
        }
    }

    /// Drops everything.
    pub(crate) fn clear(&mut self) {
        self.drop_before(self.episodes.live().end);
        if let Some(table) = &mut self.priorities {
            table.clear(&self.episodes);
        }
    }

    fn drop_before(&mut self, transition: u64) {
        let row = self.episodes.drop_before(transition);
        self.tape.drop_before(row);
    }
}
