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
    /// Writes the inputs of a network: each observation with its goal behind it, normalized. A row
    /// with a number that is not finite becomes 0. Returns whether there was none.
    pub(crate) fn write_inputs<S: Scalar>(
        &self,
        observations: &[S],
        goals: &[f64],
        inputs: &mut Vec<f32>,
    ) -> bool {
        let (len, goal_len) = (self.observation.dim(), self.goal.dim());
        inputs.resize(observations.len() / len * (len + goal_len), 0.0);
        let mut all_finite = true;
        let pairs = observations.chunks_exact(len).zip(goals.chunks_exact(goal_len));
        for (input, (observation, goal)) in inputs.chunks_exact_mut(len + goal_len).zip(pairs) {
            let (first, second) = input.split_at_mut(len);
            let normalized = self
                .observation
                .normalize_into(observation, first)
                .and_then(|()| self.goal.normalize_into(goal, second));
            if normalized.is_err() {
                input.fill(0.0);
                all_finite = false;
            }
        }
        all_finite
    }
}

/// What the next decisions of an [`Explorer`] depend on, beside its seed and its actor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExplorerState {
    /// The number of times that all environments' actions were chosen.
    decisions: u64,
    /// The number of episodes that have begun.
    episodes: u64,
    /// What each environment's episode explores.
    plans: Vec<Plan>,
}

/// What an episode explores.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Plan {
    /// Whether all of its actions are random.
    is_random: bool,
    /// The goal that the actor pursues instead of the desired one.
    nearer_goal: Option<Vec<f64>>,
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
    pub(crate) fn of<O: GoalObservation<Element: Scalar>, I>(batch: &Batch<O, I>) -> Self {
        Self {
            observations: batch.observation().iter().map(|number| number.to_f64()).collect(),
            achieved_goals: batch.achieved_goal().to_vec(),
            desired_goals: batch.desired_goal().to_vec(),
            started: batch.started().to_vec(),
        }
    }
}

/// The policy that collects: the actor with noise, random actions and random episodes.
///
/// Every decision has a stream of random numbers of its own.
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
        let plans = vec![Plan::default(); num_envs];
        Self {
            settings,
            seed,
            normalizers,
            actor: None,
            inputs: Vec::new(),
            state: ExplorerState { decisions: 0, episodes: 0, plans },
            resumed: None,
        }
    }

    /// Returns what the next decisions depend on.
    pub(crate) const fn state(&self) -> &ExplorerState {
        &self.state
    }

    /// Restores a state, and what the next decision sees, if they are of as many environments and
    /// of goals and observations of the same lengths.
    pub(crate) fn restore(&mut self, state: ExplorerState, last: LastBatch) -> bool {
        let num_envs = self.state.plans.len();
        let Normalizers { observation, goal } = &self.normalizers;
        let is_goal = |goals: &[f64], count: usize| goals.len() == count * goal.dim();
        let fits = state.plans.len() == num_envs
            && state.plans.iter().flat_map(|plan| &plan.nearer_goal).all(|goal| is_goal(goal, 1))
            && last.started.len() == num_envs
            && last.observations.len() == num_envs * observation.dim()
            && is_goal(&last.achieved_goals, num_envs)
            && is_goal(&last.desired_goals, num_envs);
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

    /// Plans the episodes that begin.
    fn begin_episodes(&mut self, last: &LastBatch) {
        let goal_len = self.normalizers.goal.dim();
        let goals = last
            .achieved_goals
            .chunks_exact(goal_len)
            .zip(last.desired_goals.chunks_exact(goal_len));
        let rows = self.state.plans.iter_mut().zip(&last.started).zip(goals);
        for ((plan, _), (achieved, desired)) in rows.filter(|((_, started), _)| **started) {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(u64::MAX - self.state.episodes);
            let ExplorationSettings { random_episodes, .. } = self.settings;
            let mut happens = |share: f64| rng.random::<f64>() < share;
            plan.is_random = happens(self.settings.random_episode_share)
                || self.state.episodes < random_episodes;
            let is_nearer = happens(self.settings.nearer_goal_share);
            let fraction: f64 = rng.random();
            plan.nearer_goal = is_nearer.then(|| {
                let pairs = achieved.iter().zip(desired);
                pairs.map(|(from, to)| from + fraction * (to - from)).collect()
            });
            self.state.episodes += 1;
        }
    }

    /// Writes the inputs of the actor: each observation and the goal that its episode pursues.
    fn write_inputs(&mut self, last: &LastBatch) {
        let goal_len = self.normalizers.goal.dim();
        let mut goals = last.desired_goals.clone();
        for (goal, plan) in goals.chunks_exact_mut(goal_len).zip(&self.state.plans) {
            if let Some(nearer) = &plan.nearer_goal {
                goal.copy_from_slice(nearer);
            }
        }
        // The buffer refuses numbers that are not finite when it records their step.
        self.normalizers.write_inputs(&last.observations, &goals, &mut self.inputs);
    }

    /// Writes the actions of all environments for the inputs.
    fn decide(&mut self, actions: &mut [f32]) {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(self.state.decisions);
        self.state.decisions += 1;
        let plans = &self.state.plans;
        let len = actions.len() / plans.len();
        let noise: Vec<f32> = actions.iter().map(|_| rng.sample(StandardNormal)).collect();
        if let Some(actor) = &mut self.actor
            && plans.iter().any(|plan| !plan.is_random)
        {
            actor.act(plans.len(), &self.inputs, Some(&noise), actions);
        }
        for (row, plan) in actions.chunks_exact_mut(len).zip(plans) {
            let chance: f64 = rng.random();
            let random: Vec<f32> = row.iter().map(|_| rng.random_range(-1.0..=1.0)).collect();
            if plan.is_random || self.actor.is_none() || chance < self.settings.random_action {
                row.copy_from_slice(&random);
            }
        }
    }
}

impl<O: GoalObservation<Element: Scalar>, I> Policy<Batch<O, I>> for Explorer {
    fn act(&mut self, batch: &Batch<O, I>, actions: &mut [f32]) {
        let last = self.resumed.take().unwrap_or_else(|| LastBatch::of(batch));
        self.begin_episodes(&last);
        self.write_inputs(&last);
        self.decide(actions);
    }
}
