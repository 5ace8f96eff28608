//! How actions are chosen while collecting.

use fetch_env::{GoalObservation, vec_env::Batch};
use her_relabel::{Normalizer, Scalar};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use super::actor::Actor;
use super::settings::ExplorationSettings;
use crate::policy::Policy;

/// What brings observations and goals to one scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Normalizers {
    pub(crate) observation: Normalizer,
    pub(crate) goal: Normalizer,
}

impl Normalizers {
    /// Writes the inputs of a network: each observation with its goal behind it, normalized.
    pub(crate) fn write_inputs<S: Scalar>(
        &self,
        observations: &[S],
        goals: &[f64],
        inputs: &mut Vec<f32>,
    ) {
        let (len, goal_len) = (self.observation.dim(), self.goal.dim());
        inputs.resize(observations.len() / len * (len + goal_len), 0.0);
        let pairs = observations.chunks_exact(len).zip(goals.chunks_exact(goal_len));
        for (input, (observation, goal)) in inputs.chunks_exact_mut(len + goal_len).zip(pairs) {
            let (first, second) = input.split_at_mut(len);
            // Numbers that are not finite never get here: the buffer has refused their step.
            let normalized = self
                .observation
                .normalize_into(observation, first)
                .and_then(|()| self.goal.normalize_into(goal, second));
            if normalized.is_err() {
                input.fill(0.0);
            }
        }
    }
}

/// What the next decisions of an [`Explorer`] depend on, beside its seed and its actor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExplorerState {
    /// The number of times that all environments' actions were chosen.
    decisions: u64,
    /// The number of episodes that have begun.
    episodes: u64,
    /// Whether the episode of each environment is wholly random.
    is_random: Vec<bool>,
}

/// The environments' last batch, as the next decision sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LastBatch {
    inputs: Vec<f32>,
    started: Vec<bool>,
}

/// The policy that collects: the actor with noise, random actions and random episodes.
///
/// Every decision has a stream of random numbers of its own.
#[derive(Debug)]
pub(crate) struct Explorer {
    settings: ExplorationSettings,
    seed: u64,
    normalizers: Normalizers,
    actor: Option<Actor>,
    inputs: Vec<f32>,
    state: ExplorerState,
    /// What the next decision sees instead of the batch that it gets.
    resumed: Option<LastBatch>,
}

impl Explorer {
    pub(crate) fn new(
        settings: ExplorationSettings,
        seed: u64,
        normalizers: Normalizers,
        num_envs: usize,
    ) -> Self {
        let is_random = vec![false; num_envs];
        Self {
            settings,
            seed,
            normalizers,
            actor: None,
            inputs: Vec::new(),
            state: ExplorerState { decisions: 0, episodes: 0, is_random },
            resumed: None,
        }
    }

    /// Returns what the next decisions depend on, and what the next one sees.
    pub(crate) fn snapshot<O: GoalObservation<Element: Scalar>, I>(
        &self,
        batch: &Batch<O, I>,
    ) -> (ExplorerState, LastBatch) {
        let mut inputs = Vec::new();
        self.normalizers.write_inputs(batch.observation(), batch.desired_goal(), &mut inputs);
        (self.state.clone(), LastBatch { inputs, started: batch.started().to_vec() })
    }

    /// Restores a snapshot, if it is of as many environments and of inputs of the same length.
    pub(crate) fn restore(&mut self, state: ExplorerState, last: LastBatch) -> bool {
        let num_envs = self.state.is_random.len();
        let Normalizers { observation, goal } = &self.normalizers;
        let fits = state.is_random.len() == num_envs
            && last.started.len() == num_envs
            && last.inputs.len() == num_envs * (observation.dim() + goal.dim());
        if fits {
            self.state = state;
            self.resumed = Some(last);
        }
        fits
    }

    /// Sets the actor and the scale of its inputs.
    pub(crate) fn set_actor(&mut self, actor: Actor, normalizers: Normalizers) {
        self.actor = Some(actor);
        self.normalizers = normalizers;
    }

    /// Writes the actions of all environments for the inputs.
    fn decide(&mut self, num_rows: usize, actions: &mut [f32]) {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(self.state.decisions);
        self.state.decisions += 1;
        let len = actions.len() / num_rows;
        let noise: Vec<f32> = actions.iter().map(|_| rng.sample(StandardNormal)).collect();
        if let Some(actor) = &mut self.actor
            && self.state.is_random.contains(&false)
        {
            actor.act(num_rows, &self.inputs, Some(&noise), actions);
        }
        for (row, is_random) in actions.chunks_exact_mut(len).zip(&self.state.is_random) {
            let chance: f64 = rng.random();
            let random: Vec<f32> = row.iter().map(|_| rng.random_range(-1.0..=1.0)).collect();
            if *is_random || self.actor.is_none() || chance < self.settings.random_action {
                row.copy_from_slice(&random);
            }
        }
    }

    /// Decides which of the episodes that begin are wholly random.
    fn begin_episodes(&mut self, started: &[bool]) {
        for (is_random, _) in
            self.state.is_random.iter_mut().zip(started).filter(|(_, started)| **started)
        {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(u64::MAX - self.state.episodes);
            let chance: f64 = rng.random();
            *is_random = self.state.episodes < self.settings.random_episodes
                || chance < self.settings.random_episode_share;
            self.state.episodes += 1;
        }
    }
}

impl<O: GoalObservation<Element: Scalar>, I> Policy<Batch<O, I>> for Explorer {
    fn act(&mut self, batch: &Batch<O, I>, actions: &mut [f32]) {
        if let Some(LastBatch { inputs, started }) = self.resumed.take() {
            self.inputs = inputs;
            self.begin_episodes(&started);
        } else {
            let (observations, goals) = (batch.observation(), batch.desired_goal());
            self.normalizers.write_inputs(observations, goals, &mut self.inputs);
            self.begin_episodes(batch.started());
        }
        self.decide(self.state.is_random.len(), actions);
    }
}
