//! How actions are chosen while collecting.

use fetch_env::{GoalObservation, vec_env::VecStep};
use her_relabel::{Dims, Scalar, StateRows};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::algorithm::Algorithm;
use super::inputs::Inputs;
use super::settings::ExplorationSettings;
use crate::normal::standard_normal;
use crate::policy::VecPolicy;

/// What the next decisions of an [`Explorer`] depend on, besides its seed and its actor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExplorerState {
    /// The number of times that all environments' actions were chosen.
    decisions: u64,
    /// The number of episodes that have begun.
    episodes: u64,
    /// Whether the episode of each environment is wholly random.
    is_random: Vec<bool>,
}

impl ExplorerState {
    /// Returns the counts, each with its name.
    pub(crate) const fn counts(&self) -> [(&'static str, u64); 2] {
        [("decisions", self.decisions), ("episodes", self.episodes)]
    }
}

/// The environments' last batch, as the next decision sees it: a row for each environment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LastBatch {
    observations: Vec<f64>,
    achieved_goals: Vec<f64>,
    desired_goals: Vec<f64>,
    started: Vec<bool>,
}

impl LastBatch {
    fn of<O: GoalObservation<Element: Scalar>, I>(batch: &VecStep<O, I>) -> Self {
        // The row of an environment that has failed, whose next action does not matter, is not
        // finite, which JSON cannot express.
        let finite = |number: f64| if number.is_finite() { number } else { 0.0 };
        let goals = |goals: &[f64]| goals.iter().map(|number| finite(*number)).collect();
        Self {
            observations: batch.observation().iter().map(|n| finite(n.to_f64())).collect(),
            achieved_goals: goals(batch.achieved_goal()),
            desired_goals: goals(batch.desired_goal()),
            started: batch.started().to_vec(),
        }
    }

    fn states(&self) -> StateRows<'_, f64> {
        StateRows {
            observation: &self.observations,
            achieved_goal: &self.achieved_goals,
            desired_goal: &self.desired_goals,
        }
    }
}

/// How the actions of all environments are chosen: those of the actor with noise, random actions
/// and random episodes.
///
/// Each decision draws from its own stream of random numbers.
pub(crate) struct Explorer {
    settings: ExplorationSettings,
    seed: u64,
    /// The actor's inputs; the vector is reused.
    rows: Vec<f32>,
    state: ExplorerState,
    /// What the next decision sees instead of the batch that it gets.
    resumed: Option<LastBatch>,
}

impl Explorer {
    pub(crate) fn new(settings: ExplorationSettings, seed: u64, num_envs: usize) -> Self {
        let is_random = vec![false; num_envs];
        Self {
            settings,
            seed,
            rows: Vec::new(),
            state: ExplorerState { decisions: 0, episodes: 0, is_random },
            resumed: None,
        }
    }

    /// Returns what the next decisions depend on.
    pub(crate) const fn state(&self) -> &ExplorerState {
        &self.state
    }

    /// Returns what the next decision sees, given the environments' last batch.
    pub(crate) fn last_batch<O: GoalObservation<Element: Scalar>, I>(
        &self,
        batch: &VecStep<O, I>,
    ) -> LastBatch {
        self.resumed.clone().unwrap_or_else(|| LastBatch::of(batch))
    }

    /// Restores a state, and what the next decision sees, if they are of as many environments and
    /// of goals and observations of these lengths.
    pub(crate) fn restore(&mut self, state: ExplorerState, last: LastBatch, dims: Dims) -> bool {
        let num_envs = self.state.is_random.len();
        let fits = state.is_random.len() == num_envs
            && last.started.len() == num_envs
            && last.observations.len() == num_envs * dims.observation
            && [&last.achieved_goals, &last.desired_goals]
                .iter()
                .all(|goals| goals.len() == num_envs * dims.goal);
        if fits {
            self.state = state;
            self.resumed = Some(last);
        }
        fits
    }

    /// Continues after the decisions and the episodes of a run.
    pub(crate) const fn skip(&mut self, decisions: u64, episodes: u64) {
        self.state.decisions = decisions;
        self.state.episodes = episodes;
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

/// An [`Explorer`] with the actor whose actions it takes.
pub(crate) struct Exploring<'a> {
    pub(crate) explorer: &'a mut Explorer,
    /// `None` before the first update: all actions are random.
    pub(crate) actor: Option<&'a mut (dyn Algorithm + 'static)>,
    pub(crate) inputs: &'a Inputs,
}

impl<O: GoalObservation<Element: Scalar>, I> VecPolicy<O, I> for Exploring<'_> {
    fn act_all(&mut self, batch: &VecStep<O, I>, actions: &mut [f32]) {
        let Self { explorer, actor, inputs } = self;
        let last = explorer.resumed.take().unwrap_or_else(|| LastBatch::of(batch));
        explorer.begin_episodes(&last.started);
        let Explorer { settings, seed, rows, state, .. } = &mut **explorer;
        let mut rng = ChaCha8Rng::seed_from_u64(*seed);
        rng.set_stream(state.decisions);
        state.decisions += 1;
        let noise: Vec<f32> = actions.iter().map(|_| standard_normal(&mut rng)).collect();
        if let Some(actor) = actor
            && state.is_random.contains(&false)
            // Always, because the numbers of a last batch are finite.
            && inputs.write(&last.states(), rows).is_ok()
        {
            actor.explore(rows, &noise, actions);
        }
        let len = actions.len() / state.is_random.len();
        for (row, is_random) in actions.chunks_exact_mut(len).zip(&state.is_random) {
            let chance: f64 = rng.random();
            let random: Vec<f32> = row.iter().map(|_| rng.random_range(-1.0..=1.0)).collect();
            if *is_random || actor.is_none() || chance < settings.random_action {
                row.copy_from_slice(&random);
            }
        }
    }
}
