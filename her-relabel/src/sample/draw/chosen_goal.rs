//! The input of a draw, and the goals that it chooses.

use crate::sample::random::{Stream, Words};
use crate::sample::settings::goals::Goal;
use crate::sample::settings::sampler::Sampler;
use crate::scalar::Scalar;
use crate::split_mix::unit;
use crate::store::episodes::Episode;
use crate::store::storage::Storage;

/// The episode of a drawn transition, and the goal of its row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChosenGoal {
    pub(crate) episode: Episode,
    pub(crate) goal: Goal,
    pub(crate) is_relabeled: bool,
}

/// The input of a draw: the stored episodes and the settings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw<'a, S> {
    pub(crate) storage: &'a Storage<S>,
    pub(crate) sampler: &'a Sampler,
}

impl<S: Scalar> Draw<'_, S> {
    /// Draws the goal of `transition` in the row `row` of the batch.
    #[inline(always)]
    pub(crate) fn choose_goal(self, words: impl Words, transition: u64, row: usize) -> ChosenGoal {
        let (episodes, sampler) = (&self.storage.episodes, self.sampler);
        let episode = episodes.of(transition);
        let is_relabeled = unit(words.word(row, Stream::Relabel)) < sampler.ratio().get();
        let strategy = sampler.goals().choose(|| words.word(row, Stream::Strategy));
        let goals = [
            Goal { source: transition, row: episode.last_row(), is_desired: true },
            strategy.draw(transition, &episode, episodes, words.word(row, Stream::Goal)),
        ];
        // No branch, because it would be unpredictable which rows are relabeled.
        ChosenGoal { episode, goal: goals[usize::from(is_relabeled)], is_relabeled }
    }
}
