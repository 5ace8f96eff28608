//! A cycle of a training run: steps of all environments, and the updates that follow.

use std::sync::Arc;
use std::time::Instant;

use fetch_env::EnvError;
use her_relabel::Batch;
use serde::{Deserialize, Serialize};

use super::error::TrainError;
use super::inputs::{Inputs, Seen};
use super::seeds::{Purpose, seed_for};
use super::trainer::{LearnEnv, Trainer};
use crate::evaluate::Episode;
use crate::workers::gather_values;

/// What a process has collected in a cycle.
#[derive(Serialize, Deserialize)]
struct CollectedShare {
    steps: u64,
    episodes: u64,
    discarded_episodes: u64,
    /// The number of episodes that ended, also of those that the buffer does not keep.
    ended: u64,
    successes: u64,
    /// The scale of what was collected.
    seen: Option<Inputs>,
    /// Whether the process has transitions to draw.
    can_draw: bool,
}

/// Environments of this process with which a run cannot go on: the first of them, and its error.
enum Failure {
    /// All have failed.
    OfAll(usize, Box<EnvError>),
    /// At least one could not be reset.
    ToReset(usize, Box<EnvError>),
}

impl<E: LearnEnv> Trainer<E> {
    /// Collects steps of all environments, and then updates the actor.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn cycle(&mut self) -> Result<(), TrainError> {
        self.check_process()?;
        let start = Instant::now();
        let can_draw = self.collect()?;
        let random_episodes = self.settings.random_episodes_of_all(self.workers.size());
        if can_draw && self.counters.episodes >= random_episodes {
            // One call for all, so that the threads stay awake between two updates.
            let threads = Arc::clone(&self.threads);
            let (updates_start, exchanging) = (Instant::now(), self.workers.seconds());
            threads.install(|| {
                (0..self.settings.schedule.updates_per_cycle).try_for_each(|_| self.update())
            })?;
            self.update_seconds.total += updates_start.elapsed().as_secs_f64();
            self.update_seconds.exchanging += self.workers.seconds() - exchanging;
            self.explorer.set_actor(self.algorithm.actor(), self.inputs.clone());
        }
        self.counters.seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Collects steps, and tells all processes. Returns whether all have transitions to draw.
    fn collect(&mut self) -> Result<bool, TrainError> {
        let (own, failure) = self.collect_own()?;
        let mut can_draw = true;
        for share in gather_values(&mut *self.workers, &own)? {
            self.counters.steps += share.steps;
            self.counters.episodes += share.episodes;
            self.counters.discarded_episodes += share.discarded_episodes;
            self.recent.add_episodes(share.ended, share.successes);
            if let Some(seen) = &share.seen {
                self.inputs.merge(seen)?;
            }
            can_draw &= share.can_draw;
        }
        let (steps, checkpoint) = (self.counters.steps, self.last_checkpoint.clone());
        match failure {
            None => Ok(can_draw),
            Some(Failure::OfAll(env_index, source)) => {
                Err(TrainError::AllFailed { steps, checkpoint, env_index, source })
            }
            Some(Failure::ToReset(env_index, source)) => {
                Err(TrainError::Stuck { steps, checkpoint, env_index, source })
            }
        }
    }

    /// Collects this process's share of steps, and returns what ends the run.
    fn collect_own(&mut self) -> Result<(CollectedShare, Option<Failure>), TrainError> {
        if self.counters.steps == 0 {
            self.begin_episodes()?;
        }
        let num_steps = self.settings.schedule.steps_per_cycle;
        let (mut ended, mut successes) = (0, 0);
        let progress = |_: usize, episode: &Episode| {
            ended += 1;
            successes += u64::from(episode.success);
        };
        let collected = self
            .collector
            .collect(num_steps, &mut self.explorer, &mut self.buffer, progress)
            .map_err(|source| TrainError::Collect {
                steps: self.counters.steps,
                checkpoint: self.last_checkpoint.clone(),
                source: Box::new(source),
            })?;
        let failure = match (collected.recorded_steps, collected.first_failure) {
            (0, Some((env_index, error))) => Some(Failure::OfAll(env_index, Box::new(error))),
            _ => collected
                .first_stuck
                .map(|(env_index, error)| Failure::ToReset(env_index, Box::new(error))),
        };
        let share = CollectedShare {
            steps: collected.recorded_steps as u64,
            episodes: collected.finished_episodes as u64,
            discarded_episodes: collected.discarded_episodes as u64,
            ended,
            successes,
            seen: self.seen(collected.recorded_steps)?,
            can_draw: !self.buffer.is_empty(),
        };
        Ok((share, failure))
    }

    /// Begins an episode in each environment.
    pub(super) fn begin_episodes(&mut self) -> Result<(), TrainError> {
        // Below the seeds of all evaluations.
        let first_seed = seed_for(self.own_seed, Purpose::Episodes, self.counters.steps) >> 24;
        self.collector.reset(Some(first_seed), &mut self.buffer).map_err(|source| {
            TrainError::Collect {
                steps: self.counters.steps,
                checkpoint: self.last_checkpoint.clone(),
                source: Box::new(source),
            }
        })
    }

    /// Takes as many transitions into the scale as were collected, with relabeled goals, as the
    /// authors do.
    fn seen(&self, num_rows: usize) -> Result<Option<Inputs>, TrainError> {
        if self.buffer.is_empty() || num_rows == 0 {
            return Ok(None);
        }
        let seed =
            seed_for(self.own_seed, Purpose::Normalizers, self.counters.steps + num_rows as u64);
        let sampler = self.sampler.with_batch_size(num_rows);
        let mut batch = Batch::<f32>::new();
        sampler.sample(&self.buffer, self.template.goal_reward(), seed, &mut batch)?;
        let mut seen = Inputs::new(&self.settings.inputs, self.buffer.config().dims())?;
        seen.update(Seen::before(&batch))?;
        Ok(Some(seen))
    }

    fn update(&mut self) -> Result<(), TrainError> {
        let seed = seed_for(self.own_seed, Purpose::Batches, self.counters.updates);
        let reward = self.template.goal_reward();
        self.batch.draw(&self.inputs, &self.sampler, &self.buffer, reward, seed)?;
        let losses = self.algorithm.update(self.batch.transitions(), &mut *self.workers);
        self.counters.updates += 1;
        if !losses.are_finite() {
            return Err(TrainError::Diverged {
                update: self.counters.updates,
                critic: losses.critic,
                actor: losses.actor,
                checkpoint: self.last_checkpoint.clone(),
            });
        }
        self.recent.add(losses);
        Ok(())
    }
}
