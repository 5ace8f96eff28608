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

/// How the actions of an episode are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum EpisodeKind {
    /// They are random.
    Random,
    /// They are the actor's with noise, or random.
    Noisy,
    /// They are the actor's.
    Quiet,
}

/// What the next decisions of an [`Explorer`] depend on, besides its seed and its actor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExplorerState {
    /// The number of times that all environments' actions were chosen.
    decisions: u64,
    /// The number of episodes that have begun.
    episodes: u64,
    /// The kind of each environment's episode.
    kinds: Vec<EpisodeKind>,
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

    fn states(&self) -> StateRows<'_, f64> {
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
            kinds: vec![EpisodeKind::Noisy; num_envs],
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
        let num_envs = self.state.kinds.len();
        let fits = state.kinds.len() == num_envs
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

    /// Decides the kinds of the episodes that begin.
    fn begin_episodes(&mut self, started: &[bool]) {
        let ExplorerState { episodes: begun, kinds, held, .. } = &mut self.state;
        let episodes = kinds.iter_mut().zip(held).zip(started).filter(|(_, started)| **started);
        for ((kind, held), _) in episodes {
            *held = 0;
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(u64::MAX - *begun);
            let chance: f64 = rng.random();
            let ExplorationSettings {
                random_episodes, random_episode_share, quiet_episodes, ..
            } = self.settings;
            *kind = if *begun < random_episodes || chance < random_episode_share {
                EpisodeKind::Random
            } else if chance < random_episode_share + quiet_episodes {
                EpisodeKind::Quiet
            } else {
                EpisodeKind::Noisy
            };
            *begun += 1;
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
        let mut noise: Vec<f32> = actions.iter().map(|_| standard_normal(&mut rng)).collect();
        let len = actions.len() / state.kinds.len();
        for (noise, kind) in noise.chunks_exact_mut(len).zip(&state.kinds) {
            if *kind == EpisodeKind::Quiet {
                noise.fill(0.0);
            }
        }
        if let Some(actor) = actor
            && state.kinds.iter().any(|kind| *kind != EpisodeKind::Random)
            // Always true, because the numbers of a last batch are finite.
            && inputs.write(&last.states(), rows).is_ok()
        {
            actor.explore(rows, &noise, actions);
        }
        let held_actions = state.held_actions.chunks_exact_mut(len);
        let episodes = state.kinds.iter().zip(&mut state.held).zip(held_actions);
        for (row, ((kind, held), held_action)) in actions.chunks_exact_mut(len).zip(episodes) {
            let chance: f64 = rng.random();
            let random: Vec<f32> = row.iter().map(|_| rng.random_range(-1.0..=1.0)).collect();
            if *kind == EpisodeKind::Random || actor.is_none() {
                if *held == 0 {
                    held_action.copy_from_slice(&random);
                    // Nothing else uses this chance here.
                    *held = 1 + (chance * settings.held_actions as f64) as u64;
                }
                *held -= 1;
                row.copy_from_slice(held_action);
            } else if *kind == EpisodeKind::Noisy && chance < settings.random_action {
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
        exploration.held_actions = 4;
        let inputs = Inputs::new(&inputs, dims).unwrap();
        let mut explorer = Explorer::new(exploration, 7, 3, dims.action);
        let mut exploring = Exploring { explorer: &mut explorer, actor: None, inputs: &inputs };
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
}
