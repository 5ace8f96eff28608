//! Moving the new goals of gathered rows.

use crate::sample::draw::chosen_goal::Draw;
use crate::sample::draw::gather::Counts;
use crate::sample::random::Words;
use crate::sample::rows::batch::{Relabeled, Rows};
use crate::sample::rows::form::{Form, State};
use crate::sample::settings::noise::GoalNoise;
use crate::scalar::Scalar;
use crate::store::storage::Storage;

impl<S: Scalar> Draw<'_, S> {
    /// Moves some of the new goals of gathered rows, and writes these rows again.
    pub(crate) fn move_goals<T: Scalar>(
        self,
        noise: GoalNoise,
        words: impl Words,
        form: impl Form<S, T>,
        counts: Counts,
        rows: &mut Rows<'_, T>,
    ) {
        let Storage { layout, tape, episodes, .. } = self.storage;
        let goal_dim = layout.dims().goal;
        // Taken out, because the rows change while the goals are read.
        let desired_pairs = std::mem::take(&mut rows.scratch.desired_pairs);
        let mut first = 0;
        for at in 0..counts.rows {
            let Relabeled { row, pairs, .. } = rows.scratch.relabeled[at];
            let goals = &mut desired_pairs[first * goal_dim..][..pairs * goal_dim];
            first += pairs;
            let (goal, copies) = goals.split_at_mut(goal_dim);
            let is_relabeled = rows.columns.goal_source[row].is_some();
            if !is_relabeled || !noise.displace::<S>(words, row, goal) {
                continue;
            }
            copies.chunks_exact_mut(goal_dim).for_each(|copy| copy.copy_from_slice(goal));
            let transition = rows.columns.transition[row].number();
            let before = episodes.of(transition).row(transition);
            let state = |row| State { layout, row: tape.row(row) };
            form.put_moved(rows, row, [state(before), state(before + pairs as u64)], goal);
        }
        rows.scratch.desired_pairs = desired_pairs;
    }
}
