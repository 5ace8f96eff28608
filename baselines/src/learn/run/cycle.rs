//! The parts of a cycle: collect steps, store what they show, update the actor.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::collecting::Steps;
use super::diagnostics::finite;
use super::env::LearnEnv;
use super::inputs::Inputs;
use super::replay::Replay;
use super::seeds::SeedUse;
use super::trainer::Trainer;
use crate::learn::algorithm::interface::Losses;
use crate::learn::error::{RunError, TrainError};
use crate::workers::gather_values;

/// The number of updates between two questions whether to go on.
const UPDATES_AT_ONCE: u64 = 10;

/// What a process has collected in a cycle.
#[derive(Serialize, Deserialize)]
struct CollectedShare {
    steps: u64,
    episodes: u64,
    discarded_episodes: u64,
    /// The number of episodes that ended, including those that the buffer does not keep.
    ended: u64,
    successes: u64,
    /// The statistics of what was collected.
    seen: Option<Inputs>,
    /// Whether the process has transitions to draw.
    can_draw: bool,
}

impl<E: LearnEnv> Trainer<E> {
    /// Collects steps of all environments, and then updates the actor.
    ///
    /// # Errors
    /// [`TrainError`].
    pub fn cycle(&mut self) -> Result<(), TrainError> {
        self.updates.check_process()?;
        let updates = match self.rest.take() {
            Some(rest) => rest.updates,
            None => {
                let collected = self.collect()?;
                self.store(collected)?
            }
        };
        self.update_while(updates, &mut || true)?;
        Ok(())
    }

    /// Takes this process's share of steps in its environments, and records them in its buffer.
    pub(super) fn collect(&mut self) -> Result<Steps, TrainError> {
        let start = Instant::now();
        if self.counters.steps == 0 {
            self.begin_episodes()?;
        }
        let num_steps = self.settings.schedule.steps_per_cycle;
        let Replay { inputs, buffer, last_cycle, .. } = &mut self.replay;
        let is_random = self.counters.updates == 0 && last_cycle.is_none();
        let actor = (!is_random).then_some(&mut *self.updates.algorithm);
        let eyes = self.eyes.as_deref_mut();
        let steps = self
            .collecting
            .collect(num_steps, actor, inputs, buffer, last_cycle.as_mut(), eyes)
            .map_err(|error| self.failed(error.into()))?;
        self.counters.seconds += start.elapsed().as_secs_f64();
        Ok(steps)
    }

    /// Stores what the steps of all processes show: counts, and the statistics that normalize
    /// inputs. Returns the number of updates that follow.
    pub(super) fn store(&mut self, own: Steps) -> Result<u64, TrainError> {
        let start = Instant::now();
        let Steps { collected, ended, successes } = own;
        let num_rows = collected.recorded_steps;
        let steps = self.counters.steps + num_rows as u64;
        let steps_of_cycle =
            self.settings.schedule.steps_per_cycle * self.collecting.collector.envs().num_envs();
        let cycle = steps.div_ceil((steps_of_cycle * self.workers.size()) as u64);
        let seen = self.replay.seen(num_rows, (SeedUse::Normalizers, steps), cycle);
        let own = CollectedShare {
            steps: num_rows as u64,
            episodes: collected.finished_episodes as u64,
            discarded_episodes: collected.discarded_episodes as u64,
            ended,
            successes,
            seen: seen.map_err(|error| self.failed(error))?,
            can_draw: self.replay.can_draw(),
        };
        let mut can_draw = true;
        for share in gather_values(&mut *self.workers, &own)? {
            self.counters.steps += share.steps;
            self.counters.episodes += share.episodes;
            self.counters.discarded_episodes += share.discarded_episodes;
            self.recent.add_episodes(share.ended, share.successes);
            if let Some(seen) = &share.seen {
                self.replay.inputs.merge(seen)?;
            }
            can_draw &= share.can_draw;
        }
        self.counters.seconds += start.elapsed().as_secs_f64();
        match (num_rows, collected.first_failure, collected.first_stuck) {
            (0, Some((env_index, source)), _) => {
                return Err(self.failed(RunError::AllFailed { env_index, source }));
            }
            (_, _, Some((env_index, source))) => {
                return Err(self.failed(RunError::Stuck { env_index, source }));
            }
            _ => {}
        }
        let random_episodes = self.settings.random_episodes_of_all(self.workers.size());
        let learns = can_draw && self.counters.episodes >= random_episodes;
        Ok(if learns { self.settings.schedule.updates_per_cycle as u64 } else { 0 })
    }

    /// Draws and updates, up to `num_updates` times while `go_on` returns true. Returns the number
    /// of updates that are left.
    pub(super) fn update_while(
        &mut self,
        num_updates: u64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<u64, TrainError> {
        let start = Instant::now();
        let Self { replay, updates, workers, counters, recent, eyes, .. } = self;
        let end = counters.updates.saturating_add(num_updates);
        let mut goes_on = true;
        while goes_on && counters.updates < end {
            let first = counters.updates;
            let numbers = first..end.min(first.saturating_add(UPDATES_AT_ONCE));
            let check = |losses: Losses| {
                counters.updates += 1;
                if !losses.are_finite() {
                    let (update, Losses { critic, actor, .. }) = (counters.updates, losses);
                    return Err(RunError::Diverged { update, critic, actor });
                }
                recent.add(losses);
                Ok(())
            };
            let eyes = eyes.as_deref_mut();
            let updated = updates.perform(numbers, replay, &mut **workers, eyes, check);
            if let Err(error) = updated {
                return Err(self.failed(error));
            }
            goes_on = go_on();
        }
        if num_updates > 0 && counters.updates == end {
            recent.diagnostics = finite("update", updates.algorithm.diagnostics()).collect();
        }
        counters.seconds += start.elapsed().as_secs_f64();
        Ok(end - counters.updates)
    }

    /// Begins an episode in each environment.
    pub(crate) fn begin_episodes(&mut self) -> Result<(), TrainError> {
        self.collecting
            .begin_episodes(self.counters.steps, &mut self.replay.buffer)
            .map_err(|error| self.failed(error.into()))
    }

    /// Returns the error of a run that failed.
    pub(super) fn failed(&self, error: RunError) -> TrainError {
        let (steps, checkpoint) = (self.counters.steps, self.last_checkpoint.clone());
        TrainError::Run { steps, checkpoint, source: Box::new(error) }
    }
}
