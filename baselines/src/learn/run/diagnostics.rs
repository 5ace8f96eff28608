//! The numbers that show how a run goes.

use goal_reward::{GoalReward, goal_distance};
use her_relabel::{Batch, ColumnsMut, GoalStrategy, Sampler, Transforms, UnitInterval};
use serde::{Deserialize, Serialize};

use super::curve::Diagnostics;
use super::env::LearnEnv;
use super::replay::Replay;
use super::seeds::{SeedUse, seed_for};
use super::trainer::Trainer;
use crate::learn::error::{RunError, TrainError};
use crate::workers::gather_values;

/// The number of transitions that are drawn to describe a buffer.
const NUM_DRAWN: usize = 1_024;

/// Returns numbers of a part of the run under their names in a row of the curve.
pub(super) fn finite<'a>(
    part: &'a str,
    numbers: impl IntoIterator<Item = (&'a str, f32)>,
) -> impl Iterator<Item = (String, f32)> {
    let numbers = numbers.into_iter().filter(|(_, number)| number.is_finite());
    numbers.map(move |(name, number)| (format!("{part}/{name}"), number))
}

/// Sums over transitions drawn from the buffers of all processes.
#[derive(Default, Serialize, Deserialize)]
struct Drawn {
    rows: f64,
    distance: f64,
    successes: f64,
    relabeled: f64,
    relabeled_successes: f64,
}

impl<E: LearnEnv> Trainer<E> {
    /// Returns the numbers of the last update, and those of the buffer as it is now.
    pub(super) fn diagnostics(&mut self) -> Result<Diagnostics, TrainError> {
        let own = self.replay.describe(self.counters.evaluations, self.counters.updates);
        let own = own.map_err(|error| self.failed(error))?;
        let mut all = Drawn::default();
        for drawn in gather_values(&mut *self.workers, &own)? {
            all.rows += drawn.rows;
            all.distance += drawn.distance;
            all.successes += drawn.successes;
            all.relabeled += drawn.relabeled;
            all.relabeled_successes += drawn.relabeled_successes;
        }
        let of_buffer = [
            ("distance", (all.distance / all.rows) as f32),
            ("success", (all.successes / all.rows) as f32),
            ("relabeled_success", (all.relabeled_successes / all.relabeled) as f32),
        ];
        let mut diagnostics = self.recent.diagnostics.clone();
        diagnostics.extend(finite("buffer", of_buffer));
        Ok(diagnostics)
    }
}

impl<E: LearnEnv> Replay<E> {
    /// Describes the buffer by transitions with their own goals, and by others as update
    /// `num_updates` draws them. `number` determines the draws.
    fn describe(&self, number: u64, num_updates: u64) -> Result<Drawn, RunError> {
        let mut drawn = Drawn::default();
        if self.buffer.is_empty() {
            return Ok(drawn);
        }
        let seed = seed_for(self.seed, SeedUse::Diagnostics, number);
        let own = Sampler::new(NUM_DRAWN, GoalStrategy::Future, UnitInterval::ZERO);
        for Goals { achieved, desired, .. } in self.draw_goals(own, seed)? {
            let is_success = self.template.goal_reward().is_success(&achieved, &desired);
            drawn.rows += 1.0;
            drawn.distance += goal_distance(&achieved, &desired);
            drawn.successes += f64::from(is_success);
        }
        let of_update = self.sampler(num_updates).with_batch_size(NUM_DRAWN).with_n_step(None);
        // A mirrored row is as far from its goal as the other.
        let of_update = of_update.with_mirrored(UnitInterval::ZERO);
        for Goals { is_relabeled, achieved, desired } in self.draw_goals(of_update, seed)? {
            let is_success = is_relabeled && self.reward().is_success(&achieved, &desired);
            drawn.relabeled += f64::from(is_relabeled);
            drawn.relabeled_successes += f64::from(is_success);
        }
        Ok(drawn)
    }

    fn draw_goals(&self, sampler: Sampler, seed: u64) -> Result<Vec<Goals>, RunError> {
        let mut batch = Batch::<f32>::new();
        let (transforms, columns) = (Transforms::default(), ColumnsMut::default());
        sampler.sample_into(&self.buffer, &self.reward(), seed, &mut batch, transforms, columns)?;
        let dim = self.buffer.config().dims().goal;
        let wide = |goal: &[f32]| goal.iter().copied().map(f64::from).collect();
        let achieved = batch.next_achieved_goal().chunks_exact(dim);
        let rows = batch.relabeled().zip(achieved).zip(batch.desired_goal().chunks_exact(dim));
        let goals = rows.map(|((is_relabeled, achieved), desired)| Goals {
            is_relabeled,
            achieved: wide(achieved),
            desired: wide(desired),
        });
        Ok(goals.collect())
    }
}

/// The goals of a transition.
struct Goals {
    is_relabeled: bool,
    /// The one achieved after the step.
    achieved: Vec<f64>,
    desired: Vec<f64>,
}
