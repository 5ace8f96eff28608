//! A cycle of a training run: steps of all environments, and the updates that follow.

use std::sync::Arc;
use std::time::Instant;

use her_relabel::Batch;

use super::error::TrainError;
use super::inputs::Seen;
use super::seeds::{Purpose, seed_for};
use super::trainer::{LearnEnv, Trainer};
use crate::evaluate::Episode;

impl<E: LearnEnv> Trainer<E> {
    /// Collects steps of all environments, and then updates the actor.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn cycle(&mut self) -> Result<(), TrainError> {
        let start = Instant::now();
        self.collect()?;
        if self.counters.episodes >= self.settings.exploration.random_episodes
            && !self.buffer.is_empty()
        {
            // One call for all, so that the threads stay awake between two updates.
            let workers = Arc::clone(&self.workers);
            workers.install(|| {
                (0..self.settings.schedule.updates_per_cycle).try_for_each(|_| self.update())
            })?;
            self.explorer.set_actor(self.algorithm.actor(), self.inputs.clone());
        }
        self.counters.seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    fn collect(&mut self) -> Result<(), TrainError> {
        let failed = |source| TrainError::Collect {
            steps: self.counters.steps,
            checkpoint: self.last_checkpoint.clone(),
            source,
        };
        if self.counters.steps == 0 {
            // Below the seeds of all evaluations.
            let first_seed = seed_for(self.seed, Purpose::Episodes, 0) >> 24;
            self.collector.reset(Some(first_seed), &mut self.buffer).map_err(failed)?;
        }
        let num_steps = self.settings.schedule.steps_per_cycle;
        let recent = &mut self.recent;
        let progress = |_: usize, episode: &Episode| recent.add_episode(episode);
        let collected = self
            .collector
            .collect(num_steps, &mut self.explorer, &mut self.buffer, progress)
            .map_err(failed)?;
        self.counters.steps += collected.recorded_steps as u64;
        self.counters.episodes += collected.finished_episodes as u64;
        self.counters.discarded_episodes += collected.discarded_episodes as u64;
        if let (0, Some((env_id, source))) = (collected.recorded_steps, collected.first_failure) {
            return Err(TrainError::AllFailed {
                steps: self.counters.steps,
                checkpoint: self.last_checkpoint.clone(),
                env_id,
                source: Box::new(source),
            });
        }
        self.update_inputs(collected.recorded_steps)
    }

    /// Takes as many transitions into the scale as were collected, with relabeled goals, as the
    /// authors do.
    fn update_inputs(&mut self, num_rows: usize) -> Result<(), TrainError> {
        if self.buffer.is_empty() || num_rows == 0 {
            return Ok(());
        }
        let seed = seed_for(self.seed, Purpose::Normalizers, self.counters.steps);
        let sampler = self.sampler.with_batch_size(num_rows);
        let mut batch = Batch::<f32>::new();
        sampler.sample(&self.buffer, self.template.goal_reward(), seed, &mut batch)?;
        Ok(self.inputs.update(Seen::before(&batch))?)
    }

    fn update(&mut self) -> Result<(), TrainError> {
        let seed = seed_for(self.seed, Purpose::Batches, self.counters.updates);
        let reward = self.template.goal_reward();
        self.batch.draw(&self.inputs, &self.sampler, &self.buffer, reward, seed)?;
        let losses = self.algorithm.update(self.batch.transitions());
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
