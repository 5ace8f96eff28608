//! How actions are chosen while collecting.

use fetch_env::GoalObservation;
use fetch_env::vec_env::{BatchObservation, VecStep};
use her_relabel::{Dims, Scalar, StateRows};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::eyes::Eyes;
use super::inputs::Inputs;
use super::last_cycle::LastCycle;
use crate::learn::algorithm::interface::Algorithm;
use crate::learn::settings::train::ExplorationSettings;
use crate::normal::standard_normal;
use crate::policy::VecPolicy;

/// What the next decisions of an [`Explorer`] depend on, besides its seed and its actor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExplorerState {
    /// The number of times that all environments' actions were chosen.
    decisions: u64,
    /// The number of episodes that have begun.
    episodes: u64,
    /// For each environment, the number of random steps left in its episode; `u64::MAX` at the start
    /// of a wholly random one.
    random_steps: Vec<u64>,
    /// For each environment, whether its episode has no noise.
    quiet: Vec<bool>,
    /// For each environment, the number of steps for which its action in `held_actions` is still
    /// held.
    held: Vec<u64>,
    held_actions: Vec<f32>,
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
        // JSON cannot express the row of a failed environment, which is not finite. Its next action
        // does not matter.
        let finite = |number: f64| if number.is_finite() { number } else { 0.0 };
        let goals = |goals: &[f64]| goals.iter().map(|number| finite(*number)).collect();
        Self {
            observations: batch.observation().iter().map(|n| finite(n.to_f64())).collect(),
            achieved_goals: goals(batch.achieved_goal()),
            desired_goals: goals(batch.desired_goal()),
            started: batch.started().to_vec(),
        }
    }

    pub(super) fn states(&self) -> StateRows<'_, f64> {
        StateRows {
            observation: &self.observations,
            achieved_goal: &self.achieved_goals,
            desired_goal: &self.desired_goals,
        }
    }
}

/// The choice of all environments' actions: the actor's with noise, random actions and random
/// episodes.
///
/// Each decision draws from its own stream of random numbers.
pub(crate) struct Explorer {
    settings: ExplorationSettings,
    seed: u64,
    /// The actor's inputs; the vector is reused.
    rows: Vec<f32>,
    state: ExplorerState,
    /// The batch that the next decision sees, after a resume, instead of the one that it gets.
    resumed: Option<LastBatch>,
}

impl Explorer {
    pub(crate) fn new(
        settings: ExplorationSettings,
        seed: u64,
        num_envs: usize,
        num_actions: usize,
    ) -> Self {
        let state = ExplorerState {
            decisions: 0,
            episodes: 0,
            random_steps: vec![0; num_envs],
            quiet: vec![false; num_envs],
            held: vec![0; num_envs],
            held_actions: vec![0.0; num_envs * num_actions],
        };
        Self { settings, seed, rows: Vec::new(), state, resumed: None }
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

    /// Restores a state and the batch that the next decision sees. Returns `false`, and restores
    /// nothing, if they do not fit the number of environments or `dims`.
    pub(crate) fn restore(&mut self, state: ExplorerState, last: LastBatch, dims: Dims) -> bool {
        let num_envs = self.state.random_steps.len();
        let fits = state.random_steps.len() == num_envs
            && state.quiet.len() == num_envs
            && state.held.len() == num_envs
            && state.held_actions.len() == num_envs * dims.action
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

    /// Skips the random streams of the decisions and episodes that a run has used.
    pub(crate) const fn skip(&mut self, decisions: u64, episodes: u64) {
        self.state.decisions = decisions;
        self.state.episodes = episodes;
    }

    /// Decides how the actions of the episodes that begin are chosen.
    fn begin_episodes(&mut self, started: &[bool]) {
        let ExplorationSettings {
            random_episodes,
            random_episode_share,
            max_random_start_steps,
            noise_free_share,
            ..
        } = self.settings;
        for env in (0..started.len()).filter(|env| started[*env]) {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(u64::MAX - self.state.episodes);
            let chance: f64 = rng.random();
            let random = self.state.episodes < random_episodes || chance < random_episode_share;
            let quiet = !random && chance < random_episode_share + noise_free_share;
            self.state.held[env] = 0;
            self.state.quiet[env] = quiet;
            self.state.random_steps[env] = match (random, quiet) {
                (true, _) => u64::MAX,
                (false, true) => 0,
                (false, false) => rng.random_range(0..=max_random_start_steps),
            };
            self.state.episodes += 1;
        }
    }
}

/// An [`Explorer`] with the actor whose actions it takes.
pub(crate) struct Exploring<'a, O: BatchObservation, I> {
    pub(crate) explorer: &'a mut Explorer,
    /// `None` before the first update: all actions are random.
    pub(crate) actor: Option<&'a mut (dyn Algorithm + 'static)>,
    pub(crate) inputs: &'a Inputs,
    /// What keeps the steps of an on-policy algorithm.
    pub(crate) last_cycle: Option<&'a mut LastCycle>,
    /// What sees every batch, and acts in some environments.
    pub(crate) eyes: Option<&'a mut (dyn Eyes<O, I> + 'static)>,
}

impl<O: GoalObservation<Element: Scalar>, I> VecPolicy<O, I> for Exploring<'_, O, I> {
    fn act_all(&mut self, batch: &VecStep<O, I>, actions: &mut [f32]) {
        let Self { explorer, actor, inputs, last_cycle, eyes } = self;
        if let Some(eyes) = eyes {
            eyes.see(batch);
        }
        let last = explorer.resumed.take().unwrap_or_else(|| LastBatch::of(batch));
        explorer.begin_episodes(&last.started);
        let Explorer { settings, seed, rows, state, .. } = &mut **explorer;
        let mut rng = ChaCha8Rng::seed_from_u64(*seed);
        rng.set_stream(state.decisions);
        state.decisions += 1;
        let mut noise: Vec<f32> = actions.iter().map(|_| standard_normal(&mut rng)).collect();
        let len = actions.len() / state.quiet.len();
        for (noise, _) in noise.chunks_exact_mut(len).zip(&state.quiet).filter(|(_, quiet)| **quiet)
        {
            noise.fill(0.0);
        }
        if let Some(actor) = actor
            && state.random_steps.contains(&0)
            // Always true, because the numbers of a last batch are finite.
            && inputs.write(&last.states(), rows).is_ok()
        {
            if inputs.have_noise() {
                inputs.add_noise(rows, &mut rng);
            }
            actor.explore(rows, &noise, actions);
            if let Some(eyes) = eyes {
                eyes.explore(&noise, actions);
            }
            if let Some(last_cycle) = last_cycle {
                last_cycle.step(batch, inputs);
                last_cycle.decide(rows, &noise);
            }
        }
        for (env, row) in actions.chunks_exact_mut(len).enumerate() {
            let chance: f64 = rng.random();
            let random: Vec<f32> = row.iter().map(|_| rng.random_range(-1.0..=1.0)).collect();
            if state.random_steps[env] > 0 || actor.is_none() {
                let held_action = &mut state.held_actions[env * len..][..len];
                if state.held[env] == 0 {
                    held_action.copy_from_slice(&random);
                    // Nothing else uses this chance here.
                    state.held[env] = 1 + (chance * settings.max_action_hold as f64) as u64;
                }
                state.held[env] -= 1;
                state.random_steps[env] = state.random_steps[env].saturating_sub(1);
                row.copy_from_slice(held_action);
            } else if !state.quiet[env] && chance < settings.random_action {
                row.copy_from_slice(&random);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collect::buffer_config;
    use crate::learn::TrainSettings;
    use fetch_env::vec_env::VecConfig;
    use fetch_env::{Task, VecEnv, make_kinematic};

    #[test]
    fn a_random_action_is_held_for_as_many_steps_as_are_drawn() {
        let envs: Vec<_> = (0..3).map(|_| make_kinematic("FetchReach-v4").unwrap()).collect();
        let dims = buffer_config(100, &envs[0]).unwrap().dims();
        let mut envs = VecEnv::new(envs, VecConfig::default()).unwrap();
        let TrainSettings { inputs, mut exploration, .. } = TrainSettings::fast(Task::Reach);
        exploration.max_action_hold = 4;
        let inputs = Inputs::new(&inputs, dims).unwrap();
        let mut explorer = Explorer::new(exploration, 7, 3, dims.action);
        let mut exploring = Exploring {
            explorer: &mut explorer,
            actor: None,
            inputs: &inputs,
            last_cycle: None,
            eyes: None,
        };
        envs.reset(Some(0)).unwrap();
        let mut rows: [Vec<Vec<f32>>; 3] = Default::default();
        for _ in 0..500 {
            let mut actions = vec![0.0; 3 * dims.action];
            exploring.act_all(envs.last_step(), &mut actions);
            for (rows, action) in rows.iter_mut().zip(actions.chunks_exact(dims.action)) {
                rows.push(action.to_vec());
            }
            envs.step(&actions).unwrap();
        }
        for rows in &rows {
            let held: Vec<_> = rows.chunk_by(|one, other| one == other).map(<[_]>::len).collect();
            assert!((1..=4).all(|steps| held.contains(&steps)), "{held:?}");
            assert!(held.iter().all(|steps| *steps <= 4), "{held:?}");
        }
        assert_ne!(rows[0], rows[1]);
    }

    #[test]
    fn only_an_episode_with_noise_begins_with_a_drawn_number_of_random_actions() {
        let TrainSettings { mut exploration, .. } = TrainSettings::fast(Task::Slide);
        exploration.random_episodes = 20;
        exploration.random_episode_share = 0.0;
        exploration.noise_free_share = 0.5;
        exploration.max_random_start_steps = 3;
        let mut explorer = Explorer::new(exploration, 7, 20, 4);
        explorer.begin_episodes(&[true; 20]);
        assert!(explorer.state.random_steps.iter().all(|steps| *steps > 1_000_000));
        let mut drawn = [false; 4];
        for _ in 0..10 {
            explorer.begin_episodes(&[true; 20]);
            let ExplorerState { random_steps, quiet, .. } = &explorer.state;
            for (steps, quiet) in random_steps.iter().zip(quiet) {
                assert!(*steps <= if *quiet { 0 } else { 3 });
                drawn[*steps as usize] |= !quiet;
            }
        }
        assert_eq!(drawn, [true; 4]);
    }
}
