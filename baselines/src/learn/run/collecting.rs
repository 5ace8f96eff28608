//! The part of a run that collects steps.

use fetch_env::wrappers::Wrapped;
use fetch_env::{ActionSpace, VecEnv};
use her_relabel::{AddError, HerBuffer, RowNumbers, StepRows};

use super::env::LearnEnv;
use super::explorer::{Explorer, Exploring, LastBatch};
use super::eyes::Eyes;
use super::far_starts::FarStarts;
use super::inputs::Inputs;
use super::last_cycle::{LastCycle, row};
use super::seeds::{SeedUse, seed_for};
use crate::collector::{Collected, Collector, CollectorError};
use crate::evaluate::Episode;
use crate::learn::algorithm::interface::Algorithm;
use crate::learn::settings::train::ExplorationSettings;

/// An environment in which steps are collected.
pub(crate) type CollectedEnv<E> = Wrapped<E, FarStarts>;

/// The environments of a run, and how actions are chosen in them.
pub(crate) struct Collecting<E: LearnEnv> {
    pub(crate) collector: Collector<CollectedEnv<E>>,
    pub(crate) explorer: Explorer,
    /// The seed of this process.
    seed: u64,
}

/// The steps of a cycle.
pub(super) struct Steps {
    pub(super) collected: Collected,
    /// The number of episodes that ended, including those that the buffer does not keep.
    pub(super) ended: u64,
    /// The number of those that ended in success.
    pub(super) successes: u64,
}

impl<E: LearnEnv> Collecting<E> {
    pub(super) fn new(
        envs: VecEnv<CollectedEnv<E>>,
        settings: ExplorationSettings,
        seed: u64,
    ) -> Self {
        let explorer_seed = seed_for(seed, SeedUse::Exploration, 0);
        let num_actions = envs.single_action_space().action_len();
        let explorer = Explorer::new(settings, explorer_seed, envs.num_envs(), num_actions);
        Self { collector: Collector::new(envs), explorer, seed }
    }

    /// Begins an episode in each environment, in a run that has taken `steps` steps so far.
    pub(super) fn begin_episodes(
        &mut self,
        steps: u64,
        buffer: &mut HerBuffer<f32>,
    ) -> Result<(), CollectorError> {
        // Below the seeds of all evaluations.
        let first_seed = seed_for(self.seed, SeedUse::Episodes, steps) >> 24;
        self.collector.reset(Some(first_seed), buffer)
    }

    /// Goes on recording in a buffer that was loaded: its unfinished episodes are in the states of
    /// the last batch, and so are the environments, which were restored.
    pub(crate) fn resume_recording(
        &self,
        last: &LastBatch,
        buffer: &mut HerBuffer<f32>,
    ) -> Result<(), AddError> {
        let (batch, states, dims) =
            (self.collector.envs().last_step(), last.states(), buffer.config().dims());
        for (at, env_index) in batch.env_index().iter().enumerate() {
            // The others begin an episode in their next row, or have failed.
            if buffer.unfinished_steps(*env_index)?.is_some() {
                let rows: StepRows<'_, f64> = StepRows {
                    env_index: &[*env_index],
                    observation: row(states.observation, dims.observation, at),
                    achieved_goal: row(states.achieved_goal, dims.goal, at),
                    desired_goal: row(states.desired_goal, dims.goal, at),
                    numbers: Some(RowNumbers {
                        source: batch.source(),
                        number: &batch.number()[at..=at],
                    }),
                    ..StepRows::default()
                };
                let _ = buffer.resume(&rows)?;
            }
        }
        Ok(())
    }

    /// Takes steps in each environment with the actor's actions, or with random ones if there is no
    /// actor. Keeps them in `last_cycle` if there is one. `eyes` sees them, and acts, too.
    pub(super) fn collect(
        &mut self,
        num_steps: usize,
        actor: Option<&mut (dyn Algorithm + 'static)>,
        inputs: &Inputs,
        buffer: &mut HerBuffer<f32>,
        mut last_cycle: Option<&mut LastCycle>,
        eyes: Option<&mut (dyn Eyes<E::Observation, E::Info> + 'static)>,
    ) -> Result<Steps, CollectorError> {
        let (mut ended, mut successes) = (0, 0);
        let count = |_: usize, episode: &Episode| {
            ended += 1;
            successes += u64::from(episode.success);
        };
        if let Some(last_cycle) = &mut last_cycle {
            last_cycle.clear();
        }
        let explorer = &mut self.explorer;
        let mut policy =
            Exploring { explorer, actor, inputs, last_cycle: last_cycle.as_deref_mut(), eyes };
        let collected = self.collector.collect(num_steps, &mut policy, buffer, count)?;
        if let Some(last_cycle) = last_cycle {
            last_cycle.step(self.collector.envs().last_step(), inputs);
        }
        Ok(Steps { collected, ended, successes })
    }
}
