//! Drawing rows again whose goal was already achieved before the step.

use goal_reward::{GoalPairs, GoalReward};
use prefetch_index::prefetch_index;

use crate::sample::draw::chosen_goal::Draw;
use crate::sample::error::SampleError;
use crate::sample::random::{BatchWords, MAX_DRAWS, Redrawn, Stream, Words};
use crate::sample::rows::batch::{Rows, ScratchRows, Workspace};
use crate::sample::rows::columns::refill;
use crate::sample::rows::copy::put_wide;
use crate::scalar::Scalar;
use crate::split_mix::unit;
use crate::store::storage::Storage;

/// The number of rows whose memory is requested at a time.
const AHEAD: usize = 16;

impl<S: Scalar> Draw<'_, S> {
    /// Chooses the draw of each row of a batch. `pick` draws the transitions.
    ///
    /// The rows are drawn in rounds. In each, the reward function judges all drawn rows with one
    /// call, and those that are not kept are drawn again in the next round, at most [`MAX_DRAWS`]
    /// times in all.
    pub(crate) fn redraw<'w, T: Scalar>(
        self,
        pick: impl Fn(u64) -> u64,
        reward: &dyn GoalReward,
        words: BatchWords,
        rows: &mut Rows<'_, T>,
        workspace: &'w mut Workspace,
    ) -> Result<Redrawn<'w>, SampleError> {
        let Workspace { attempts, pending, achieved, .. } = workspace;
        let kept = self.sampler.keep_already_achieved().get();
        let goal_dim = self.storage.layout.dims().goal;
        refill(attempts, rows.len(), 0)?;
        refill(pending, rows.len(), 0)?;
        pending.iter_mut().enumerate().for_each(|(at, row)| *row = at);
        for attempt in 0..MAX_DRAWS - 1 {
            self.put_states(&pick, words.attempt(attempt), pending, &mut rows.scratch);
            let elements = pending.len() * goal_dim;
            let states = &rows.scratch.achieved_pairs[..elements];
            let goals = &rows.scratch.desired_pairs[..elements];
            refill(achieved, pending.len(), false)?;
            reward.is_success_batch(GoalPairs::new(states, goals, goal_dim)?, achieved)?;
            let chances = words.chances(attempt);
            let mut at = 0;
            pending.retain(|row| {
                let is_kept = !achieved[at] || unit(chances.word(*row, Stream::Transition)) < kept;
                at += 1;
                !is_kept
            });
            pending.iter().for_each(|row| attempts[*row] += 1);
            if pending.is_empty() {
                break;
            }
        }
        Ok(Redrawn::new(words, attempts))
    }

    /// Writes the pairs of goals of the pending rows: the goal achieved before the step, and the
    /// goal of the row.
    fn put_states<T>(
        self,
        pick: impl Fn(u64) -> u64,
        words: BatchWords,
        pending: &[usize],
        scratch: &mut ScratchRows<'_, T>,
    ) {
        let Storage { layout, episodes, tape, .. } = self.storage;
        let mut at = 0;
        // In stages, each of which requests the memory that the next one reads.
        for rows in pending.chunks(AHEAD) {
            let mut transitions = [0; AHEAD];
            for (transition, row) in transitions.iter_mut().zip(rows) {
                *transition = pick(words.word(*row, Stream::Transition));
                episodes.prefetch_cell(*transition);
            }
            transitions[..rows.len()].iter().for_each(|id| episodes.prefetch_record(*id));
            let mut goals = [(&[][..], &[][..], false); AHEAD];
            for ((goals, transition), row) in goals.iter_mut().zip(transitions).zip(rows) {
                let chosen = self.choose_goal(words, transition, *row);
                let state = &tape.rows_from(chosen.episode.row(transition))[layout.achieved_goal()];
                let goal = &tape.rows_from(chosen.goal.row)[layout.goal(chosen.goal.is_desired)];
                prefetch_index(state, 0);
                prefetch_index(goal, 0);
                *goals = (state, goal, chosen.is_relabeled);
            }
            for ((achieved, desired, is_relabeled), row) in goals.iter().zip(rows) {
                put_wide(scratch.achieved_pairs, at, achieved);
                put_wide(scratch.desired_pairs, at, desired);
                if let Some(noise) = self.sampler.goal_noise().filter(|_| *is_relabeled) {
                    let len = desired.len();
                    let desired = &mut scratch.desired_pairs[at * len..][..len];
                    noise.displace::<S>(words, *row, desired);
                }
                at += 1;
            }
        }
    }
}
