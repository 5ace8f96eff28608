//! Picking transitions, uniformly or by priority, and the importance weights of the picked ones.

use crate::sample::batch::Batch;
use crate::sample::draws::{Draws, Purpose, below, unit};
use crate::scalar::Scalar;
use crate::store::episodes::Episodes;
use crate::store::priorities::PriorityUnit;
use crate::store::priority_table::PriorityTable;
use crate::store::storage::Storage;
use crate::unit_interval::UnitInterval;

/// A live transition, each with the same probability, from a random word. At least one must live.
#[inline(always)]
pub(crate) fn uniform(episodes: &Episodes, word: u64) -> u64 {
    let live = episodes.live();
    live.start + below(word, live.end - live.start)
}

/// A live transition, by priority, from a random word. At least one priority must be positive.
#[inline]
pub(crate) fn by_priority(table: &PriorityTable, episodes: &Episodes, word: u64) -> u64 {
    let drawn = table.tree.draw(unit(word));
    match table.settings.unit() {
        PriorityUnit::Transition => drawn,
        PriorityUnit::Episode => {
            let live = episodes.get(drawn).live();
            let another = Draws::new(word).word(0, Purpose::Transition);
            live.start + below(another, live.end - live.start)
        }
    }
}

/// Computes the importance weights of the gathered rows, with the exponent `beta`.
pub(crate) fn weigh<T: Scalar>(beta: UnitInterval, storage: &Storage<T>, batch: &mut Batch<T>) {
    let Some(table) = &storage.priorities else { return };
    let Batch { columns, judged, .. } = batch;
    let shares = columns.transition.iter().map(|id| share(table, &storage.episodes, id.number()));
    judged.shares.clear();
    judged.shares.extend(shares);
    let least = judged.shares.iter().copied().fold(f64::INFINITY, f64::min);
    for (weight, share) in columns.importance_weight.iter_mut().zip(&judged.shares) {
        // The least probable row has the highest weight, by which all are divided.
        *weight = T::from_f64((least / share).powf(beta.get()));
    }
}

/// A number in proportion to the probability of drawing a live transition that was picked.
fn share(table: &PriorityTable, episodes: &Episodes, transition: u64) -> f64 {
    match table.settings.unit() {
        PriorityUnit::Transition => table.tree.weight(transition),
        PriorityUnit::Episode => {
            let episode = episodes.of(transition);
            let len = (episode.end - episode.start) as f64;
            // Even the smallest positive number must not become 0.
            (table.tree.weight(episode.number) / len).max(f64::MIN_POSITIVE)
        }
    }
}
