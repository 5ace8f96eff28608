//! The input of a draw, and the goal of a drawn row.

use crate::sample::draws::{Purpose, Words};
use crate::sample::goals::Goal;
use crate::sample::sampler::Sampler;
use crate::scalar::Scalar;
use crate::split_mix::unit;
use crate::store::episodes::Episode;
use crate::store::storage::Storage;

/// The episode of a drawn transition, and the goal of its row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aim {
    pub(crate) episode: Episode,
    pub(crate) goal: Goal,
    pub(crate) is_relabeled: bool,
}

/// The input of a draw: the stored episodes and the settings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Task<'a, S> {
    pub(crate) storage: &'a Storage<S>,
    pub(crate) sampler: &'a Sampler,
}

impl<S: Scalar> Task<'_, S> {
    /// Draws the goal of `transition` in the row `row` of the batch.
    #[inline(always)]
    pub(crate) fn aim(self, words: impl Words, transition: u64, row: usize) -> Aim {
        let (episodes, sampler) = (&self.storage.episodes, self.sampler);
        let episode = episodes.of(transition);
        let is_relabeled = unit(words.word(row, Purpose::Relabel)) < sampler.ratio().get();
        let strategy = sampler.goals().choose(|| words.word(row, Purpose::Strategy));
        let goals = [
            Goal { source: transition, row: episode.last_row(), is_desired: true },
            strategy.draw(transition, &episode, episodes, words.word(row, Purpose::Goal)),
        ];
        // No branch, because it would be unpredictable which rows are relabeled.
        Aim { episode, goal: goals[usize::from(is_relabeled)], is_relabeled }
    }
}
