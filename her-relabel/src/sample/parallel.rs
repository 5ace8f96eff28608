//! Gathering on several threads.

use crate::Scalar;
use crate::sample::columns::Rows;
use crate::sample::draws::Draws;
use crate::sample::gather::{Counts, gather};
use crate::sample::sampler::Sampler;
use crate::store::storage::Storage;

/// The most rows that are not worth another thread.
const PART: usize = 512;

/// [`gather`] on the threads of the current rayon pool. Every row is a function of the random words of its
/// place in the batch, so the division into parts decides nothing but who works.
pub(crate) fn gather_parallel<T: Scalar>(
    storage: &Storage<T>,
    sampler: &Sampler,
    draws: Draws,
    pick: impl Fn(u64) -> u64 + Copy + Sync,
    rows: &mut Rows<'_, T>,
) -> Counts {
    if rows.len() <= PART {
        return gather(storage, sampler, draws, pick, rows);
    }
    let middle = rows.len() / 2;
    let (mut front, mut back) = rows.split_at(middle);
    let (first, second) = rayon::join(
        || gather_parallel(storage, sampler, draws, pick, &mut front),
        || gather_parallel(storage, sampler, draws, pick, &mut back),
    );
    // The back's relabeled rows follow the front's, as in a batch of one part.
    let goal = rows.dims.goal;
    rows.relabeled.copy_within(middle..middle + second.rows, first.rows);
    let pairs = middle * rows.window * goal..(middle * rows.window + second.pairs) * goal;
    rows.achieved_pairs.copy_within(pairs.clone(), first.pairs * goal);
    rows.desired_pairs.copy_within(pairs, first.pairs * goal);
    Counts { rows: first.rows + second.rows, pairs: first.pairs + second.pairs }
}
