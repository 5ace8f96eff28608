//! Redrawing rows whose goal was already achieved before the step.

use goal_reward::{GoalPairs, GoalReward};

use crate::sample::aim::Task;
use crate::sample::copy::put_wide;
use crate::sample::draws::{Draws, MAX_DRAWS, Purpose, Redrawn, Words};
use crate::sample::memory::{refill, resize};
use crate::sample::sampler::SampleError;
use crate::scalar::Scalar;
use crate::split_mix::unit;
use crate::store::storage::Storage;

/// The number of rows whose memory is requested at a time.
const AHEAD: usize = 16;

/// Memory for redrawing. Only the attempts are read afterwards.
#[derive(Clone, Debug, Default)]
pub(crate) struct Redraws {
    /// The draw, from 0, that each row is taken from.
    attempts: Vec<u8>,
    /// The rows that are drawn in the current round.
    pending: Vec<usize>,
    achieved: Vec<f64>,
    desired: Vec<f64>,
    already: Vec<bool>,
}

impl Redraws {
    /// Chooses the draw of each row of a batch. `pick` draws the transitions.
    ///
    /// The rows are drawn in rounds. In each, the reward function judges all drawn rows with one
    /// call, and those that are not kept are drawn again in the next round, at most [`MAX_DRAWS`]
    /// times in all.
    pub(crate) fn choose<S: Scalar, F: GoalReward + ?Sized>(
        &mut self,
        task: Task<'_, S>,
        reward: &F,
        draws: Draws,
        pick: impl Fn(u64) -> u64,
    ) -> Result<Redrawn<'_>, SampleError> {
        let (len, goal_dim) = (task.sampler.batch_size(), task.storage.layout.dims().goal);
        let kept = task.sampler.already_achieved().get();
        refill(&mut self.attempts, len, 0)?;
        resize(&mut self.achieved, len * goal_dim, 0.0)?;
        resize(&mut self.desired, len * goal_dim, 0.0)?;
        resize(&mut self.already, len, false)?;
        refill(&mut self.pending, len, 0)?;
        self.pending.iter_mut().enumerate().for_each(|(at, row)| *row = at);
        for attempt in 0..MAX_DRAWS - 1 {
            self.draw_pairs(task, draws.attempt(attempt), &pick);
            let count = self.pending.len();
            let (achieved, desired) =
                (&self.achieved[..count * goal_dim], &self.desired[..count * goal_dim]);
            let pairs = GoalPairs::new(achieved, desired, goal_dim)?;
            let already = &mut self.already[..count];
            already.fill(false);
            reward.is_success_batch(pairs, already)?;
            let chances = draws.chances(attempt);
            let mut at = 0;
            self.pending.retain(|row| {
                let is_kept = !already[at] || unit(chances.word(*row, Purpose::Transition)) < kept;
                at += 1;
                !is_kept
            });
            self.pending.iter().for_each(|row| self.attempts[*row] += 1);
            if self.pending.is_empty() {
                break;
            }
        }
        Ok(Redrawn::new(draws, &self.attempts))
    }

    /// Writes the pairs of goals of the pending rows: the goal achieved before the step, and the
    /// goal of the row.
    fn draw_pairs<S: Scalar>(
        &mut self,
        task: Task<'_, S>,
        words: Draws,
        pick: impl Fn(u64) -> u64,
    ) {
        let Storage { layout, episodes, tape, .. } = task.storage;
        let mut at = 0;
        // In stages, each of which requests the memory that the next one reads.
        for rows in self.pending.chunks(AHEAD) {
            let mut transitions = [0; AHEAD];
            for (transition, row) in transitions.iter_mut().zip(rows) {
                *transition = pick(words.word(*row, Purpose::Transition));
                episodes.prefetch_cell(*transition);
            }
            transitions[..rows.len()].iter().for_each(|id| episodes.prefetch_record(*id));
            let mut goals = [(&[][..], &[][..], false); AHEAD];
            for ((goals, transition), row) in goals.iter_mut().zip(transitions).zip(rows) {
                let aim = task.aim(words, transition, *row);
                let state = &tape.rows_from(aim.episode.row(transition))[layout.achieved_goal()];
                let goal = &tape.rows_from(aim.goal.row)[layout.goal(aim.goal.is_desired)];
                prefetch_index::prefetch_index(state, 0);
                prefetch_index::prefetch_index(goal, 0);
                *goals = (state, goal, aim.is_relabeled);
            }
            for ((achieved, desired, is_relabeled), row) in goals.iter().zip(rows) {
                put_wide(&mut self.achieved, at, achieved);
                put_wide(&mut self.desired, at, desired);
                if let Some(noise) = task.sampler.goal_noise().filter(|_| *is_relabeled) {
                    let len = desired.len();
                    noise.displace::<S>(words, *row, &mut self.desired[at * len..][..len]);
                }
                at += 1;
            }
        }
    }
}
