//! The contents of a buffer: finished episodes, and the rows of unfinished ones.

use crate::scalar::Scalar;
use crate::split_mix::{unit, word_at};
use crate::store::config::{BufferConfig, ConfigError};
use crate::store::episodes::{Ending, Episode, Episodes};
use crate::store::fields::Fields;
use crate::store::layout::Layout;
use crate::store::motionless::MotionlessEpisodes;
use crate::store::priority_table::PriorityTable;
use crate::store::tape::Tape;

/// The newest `capacity` transitions of finished episodes.
#[derive(Clone, Debug)]
pub(crate) struct Storage<T> {
    pub(crate) layout: Layout,
    pub(crate) fields: Fields,
    pub(crate) capacity: usize,
    pub(crate) episodes: Episodes,
    pub(crate) tape: Tape<T>,
    pub(crate) priorities: Option<PriorityTable>,
    pub(crate) motionless: Option<MotionlessEpisodes>,
    /// The number of episodes that have ended, if it decides whether they are kept.
    pub(crate) ended: u64,
}

impl<T: Scalar> Storage<T> {
    /// Creates an empty store from a checked configuration.
    pub(crate) fn new(config: &BufferConfig) -> Result<Self, ConfigError> {
        let layout = Layout::new::<T>(config)?;
        Ok(Self {
            layout,
            fields: Fields::new(config.fields()),
            capacity: config.capacity(),
            episodes: Episodes::new(0, 0),
            tape: Tape::new(layout.row(), config.capacity(), 0),
            priorities: config.priorities().map(PriorityTable::new),
            motionless: config.motionless_episodes(),
            ended: 0,
        })
    }

    /// Adds the rows of an episode of 1 to `capacity` transitions, and drops the oldest ones that
    /// no longer fit. A motionless episode may be left out.
    pub(crate) fn push_episode(&mut self, rows: &[T], ending: Ending) {
        if let Some(motionless) = &self.motionless {
            let number = self.ended;
            self.ended = number.wrapping_add(1);
            if !keeps(motionless, number, &self.layout, rows) {
                return;
            }
        }
        self.store_episode(rows, ending);
    }

    /// Adds an episode as [`push_episode`](Self::push_episode) does, even if it is motionless.
    pub(crate) fn store_episode(&mut self, rows: &[T], ending: Ending) {
        let steps = (rows.len() / self.layout.row() - 1) as u64;
        let kept = self.capacity as u64 - steps;
        let live = self.episodes.live();
        // Old rows are dropped first, so that the tape can reuse their memory.
        self.drop_before(live.end.saturating_sub(kept));
        self.tape.push_rows(rows);
        self.episodes.push(steps, ending);
        if let Some(table) = &mut self.priorities {
            table.follow(&self.episodes);
        }
    }

    /// Replaces `rows` with those of the newest `most` steps of a stored episode, in the form that
    /// [`push_episode`](Self::push_episode) takes.
    pub(crate) fn copy_episode(&self, episode: &Episode, most: usize, rows: &mut Vec<T>) {
        let first = episode.start.max(episode.end.saturating_sub(most as u64));
        rows.clear();
        for row in episode.row(first)..=episode.last_row() {
            rows.extend_from_slice(self.tape.row(row));
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

/// Returns whether the episode of this number, with these rows, is kept.
fn keeps<T: Scalar>(
    motionless: &MotionlessEpisodes,
    number: u64,
    layout: &Layout,
    rows: &[T],
) -> bool {
    let first = &rows[layout.achieved_goal()];
    let is_near = |row: &[T]| {
        let pairs = row[layout.achieved_goal()].iter().zip(first);
        let squares = pairs.map(|(goal, first)| (goal.to_f64() - first.to_f64()).powi(2));
        squares.sum::<f64>().sqrt() <= motionless.max_distance()
    };
    unit(word_at(motionless.seed(), number)) < motionless.kept().get()
        || !rows.chunks_exact(layout.row()).all(is_near)
}

/// The rows of an environment's unfinished episode; none if no episode is under way.
#[derive(Clone, Debug, Default)]
pub(crate) struct Unfinished<T> {
    pub(crate) rows: Vec<T>,
    pub(crate) desired_goal: Vec<T>,
    /// Whether the episode was discarded, so that more of its steps may arrive.
    pub(crate) is_discarded: bool,
    /// The newest row of the environment; `None` if it has no number. It is not saved.
    pub(crate) newest: Option<RowNumber>,
}

/// The number of a row among all rows of its environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RowNumber {
    pub(crate) source: u64,
    pub(crate) number: u64,
}

impl<T: Scalar> Unfinished<T> {
    pub(crate) fn is_under_way(&self) -> bool {
        !self.rows.is_empty()
    }

    /// Returns the number of recorded steps, of which at most the newest `capacity` are kept.
    pub(crate) fn steps(&self, layout: &Layout) -> usize {
        (self.rows.len() / layout.row()).saturating_sub(1)
    }

    /// Forgets the episode, whose remaining steps may still arrive.
    pub(crate) fn discard(&mut self) {
        self.rows.clear();
        self.is_discarded = true;
    }

    /// Forgets an episode that has ended.
    pub(crate) fn end(&mut self) {
        self.rows.clear();
    }
}
