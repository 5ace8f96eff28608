//! Evaluation of a policy over seeded episodes.

use std::ops::Range;

use fetch_env::vec_env::{VecEnvError, VecReset};
use fetch_env::{ActionElement, ActionSpace, Env, EnvError, GoalEnv, Info, Reset, Step, VecEnv};
use serde::{Deserialize, Serialize};

use crate::policy::{Policy, PolicyError, VecPolicy};
use crate::statistics::{Estimate, StatisticsError};
use crate::workers::UnreadableMessage;

/// The result of one episode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Episode {
    /// Seed of the reset; `None` if it continued the environment's random numbers.
    pub seed: Option<u64>,
    /// Sum of the rewards.
    pub episode_return: f64,
    /// Number of steps.
    pub episode_length: usize,
    /// Distance between achieved and desired goal after the last step: meters in the Fetch tasks.
    pub final_distance: f64,
    /// Whether the last step was a success: the benchmark's success rate counts these.
    pub success: bool,
    /// Whether any step was a success.
    pub success_any: bool,
}

/// The episodes of an evaluation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// One entry for each episode, in the order of their seeds.
    pub episodes: Vec<Episode>,
}

/// The figures of an evaluation, each with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Share of episodes whose last step was a success.
    pub success_rate: Estimate,
    /// Share of episodes with a success at any step.
    pub success_any_rate: Estimate,
    /// Mean sum of rewards.
    pub episode_return_mean: Estimate,
    /// Mean number of steps.
    pub episode_length_mean: Estimate,
    /// Mean distance at the end: meters in the Fetch tasks.
    pub final_distance_mean: Estimate,
}

/// Error returned when a policy is evaluated or its episodes are summarized.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum EvaluationError {
    /// There are no episodes to take a mean of.
    #[error("there is no episode to evaluate: run at least one")]
    NoEpisodes,
    /// The policy does not fit this environment.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// The environment failed.
    #[error("episode {episode} (seed {seed}) failed")]
    Environment {
        /// The episode, counted from 0.
        episode: usize,
        /// The seed of its reset.
        seed: u64,
        /// The environment's error.
        source: EnvError,
    },
    /// The environments could not be stepped together.
    #[error(transparent)]
    Vec(#[from] VecEnvError),
    /// A return or a distance is not a finite number.
    #[error("no mean can be taken over the episodes")]
    Statistics(#[from] StatisticsError),
    /// The caller stopped it.
    #[error("the evaluation was stopped before its end")]
    Stopped,
    /// Another process sent episodes that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] UnreadableMessage),
}

debug_as_display!(EvaluationError);

/// The number of steps after which an episode counts as endless.
pub(crate) const MAX_STEPS: usize = 100_000;

/// The largest count that a snapshot or a checkpoint may have: more than any run reaches, and small
/// enough that no sum overflows.
pub(crate) const MAX_COUNT: u64 = 1 << 40;

/// Returns consecutive seeds that wrap to 0 after `u64::MAX`.
pub(crate) fn seeds(first_seed: u64) -> impl Iterator<Item = u64> {
    std::iter::successors(Some(first_seed), |seed| Some(seed.wrapping_add(1)))
}

/// Runs `count` episodes, reset with the seeds `first_seed`, `first_seed + 1`, ..., each until it
/// is terminated or truncated, and calls `progress` after each.
///
/// # Errors
/// [`EvaluationError::Policy`] if the policy does not fit the environment;
/// [`EvaluationError::Environment`] if a reset or a step fails, or with [`EnvError::Endless`] if an
/// episode has not ended after 100,000 steps.
pub fn evaluate<E: GoalEnv>(
    env: &mut E,
    policy: &mut (impl Policy<E::Observation, ActionElement<E>> + ?Sized),
    count: usize,
    first_seed: u64,
    mut progress: impl FnMut(&Episode),
) -> Result<Evaluation, EvaluationError> {
    check_policy(env, policy)?;
    let mut episodes = Vec::new();
    for (episode, seed) in (0..count).zip(seeds(first_seed)) {
        let failed = |source| EvaluationError::Environment { episode, seed, source };
        let result = run_episode(env, policy, seed, failed, |_, _| Ok(()))?;
        progress(&result);
        episodes.push(result);
    }
    Ok(Evaluation { episodes })
}

/// Checks that a policy fits an environment.
pub(crate) fn check_policy<E: Env>(
    env: &E,
    policy: &(impl Policy<E::Observation, ActionElement<E>> + ?Sized),
) -> Result<(), PolicyError> {
    policy.check_spaces(env.observation_space(), &env.action_space().clone().into())
}

/// Checks that a policy fits many environments.
pub(crate) fn check_vec_policy<E: GoalEnv + Send + 'static>(
    envs: &VecEnv<E>,
    policy: &(impl VecPolicy<E::Observation, E::Info, ActionElement<E>> + ?Sized),
) -> Result<(), PolicyError> {
    let action_space = envs.single_action_space().clone().into();
    policy.check_spaces(envs.single_observation_space(), &action_space)
}

/// An event of an episode.
pub(crate) enum Event<'a, E: Env> {
    Start(&'a Reset<E::Observation, E::Info>),
    Step(&'a [ActionElement<E>], &'a Step<E::Observation, E::Info>),
}

/// Runs an episode until it is terminated or truncated, and calls `watch` with the environment
/// after each event. `failed` converts the environment's errors.
pub(crate) fn run_episode<E: GoalEnv, X>(
    env: &mut E,
    policy: &mut (impl Policy<E::Observation, ActionElement<E>> + ?Sized),
    seed: u64,
    failed: impl Fn(EnvError) -> X,
    mut watch: impl FnMut(&E, Event<'_, E>) -> Result<(), X>,
) -> Result<Episode, X> {
    policy.reset();
    let start = env.reset(Some(seed)).map_err(&failed)?;
    watch(env, Event::Start(&start))?;
    let episode = Episode::new(Some(seed));
    finish_episode(env, policy, start.observation, episode, failed, watch)
}

/// Continues an episode from an observation, as [`run_episode`] does.
pub(crate) fn finish_episode<E: GoalEnv, X>(
    env: &mut E,
    policy: &mut (impl Policy<E::Observation, ActionElement<E>> + ?Sized),
    mut observation: E::Observation,
    mut episode: Episode,
    failed: impl Fn(EnvError) -> X,
    mut watch: impl FnMut(&E, Event<'_, E>) -> Result<(), X>,
) -> Result<Episode, X> {
    let mut action = vec![ActionElement::<E>::default(); env.action_space().action_len()];
    loop {
        policy.act(&observation, &mut action);
        let step = env.step(&action).map_err(&failed)?;
        watch(env, Event::Step(&action, &step))?;
        let is_last = step.is_last();
        episode.add(step.reward, step.info.as_ref());
        if is_last {
            return Ok(episode);
        }
        if episode.episode_length >= MAX_STEPS {
            return Err(failed(EnvError::Endless { steps: MAX_STEPS }));
        }
        observation = step.observation;
    }
}

/// Runs `count` episodes as [`evaluate`] does, as many at a time as there are environments, and
/// calls `progress` after each. `policy` chooses the actions of all environments, a row for each.
///
/// The episodes are the same as in a single environment with the same seeds. The environments' own
/// episodes are abandoned, and [`AutoresetMode`](fetch_env::vec_env::AutoresetMode) does not
/// matter.
///
/// # Errors
/// [`EvaluationError::Policy`] if the policy does not fit the environments;
/// [`EvaluationError::Environment`] if a reset or a step fails; [`EvaluationError::Vec`] if the
/// environments are in flight.
pub fn evaluate_vec<E: GoalEnv + Send + 'static>(
    envs: &mut VecEnv<E>,
    policy: &mut (impl VecPolicy<E::Observation, E::Info, ActionElement<E>> + ?Sized),
    count: usize,
    first_seed: u64,
    progress: impl FnMut(&Episode),
) -> Result<Evaluation, EvaluationError> {
    evaluate_range(envs, policy, 0..count, first_seed, progress, &mut || true)
}

/// Runs episodes as [`evaluate_vec`] does while `go_on`, called before each step of all
/// environments, returns true.
///
/// # Errors
/// Those of [`evaluate_vec`], and [`EvaluationError::Stopped`] when `go_on` returns false.
pub fn evaluate_vec_while<E: GoalEnv + Send + 'static>(
    envs: &mut VecEnv<E>,
    policy: &mut (impl VecPolicy<E::Observation, E::Info, ActionElement<E>> + ?Sized),
    count: usize,
    first_seed: u64,
    mut go_on: impl FnMut() -> bool,
) -> Result<Evaluation, EvaluationError> {
    evaluate_range(envs, policy, 0..count, first_seed, |_| (), &mut go_on)
}

/// Runs the episodes of a range as [`evaluate_vec`] does while `go_on` returns true: a part of an
/// evaluation whose first episode has the seed `first_seed`.
pub(crate) fn evaluate_range<E: GoalEnv + Send + 'static>(
    envs: &mut VecEnv<E>,
    policy: &mut (impl VecPolicy<E::Observation, E::Info, ActionElement<E>> + ?Sized),
    range: Range<usize>,
    first_seed: u64,
    mut progress: impl FnMut(&Episode),
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Evaluation, EvaluationError> {
    check_vec_policy(envs, policy)?;
    let num_envs = envs.num_envs();
    let len = envs.single_action_space().action_len();
    let mut actions = vec![ActionElement::<E>::default(); num_envs * len];
    let mut episodes = Vec::new();
    while episodes.len() < range.len() {
        let first = episodes.len();
        let number = range.start + first;
        let size = num_envs.min(range.len() - first);
        let seeds: Vec<_> = (0..num_envs as u64)
            .map(|row| Some(first_seed.wrapping_add(number as u64).wrapping_add(row)))
            .collect();
        let failed = |row: usize, error: &EnvError| EvaluationError::Environment {
            episode: number + row,
            seed: seeds[row].unwrap_or_default(),
            source: error.clone(),
        };
        policy.reset_all();
        let reset = VecReset { seeds: Some(&seeds), ..VecReset::default() };
        if let Some((row, error)) = envs.reset_with(&reset)?.errors().find(|(row, _)| *row < size) {
            return Err(failed(row, error));
        }
        episodes.extend(seeds[..size].iter().map(|seed| Episode::new(*seed)));
        let mut running = vec![true; size];
        while running.contains(&true) {
            if !go_on() {
                return Err(EvaluationError::Stopped);
            }
            policy.act_all(envs.last_step(), &mut actions);
            let batch = envs.step(&actions)?;
            for (row, is_running) in running.iter_mut().enumerate().filter(|(_, running)| **running)
            {
                let (true, Some(info)) = (batch.stepped()[row], batch.step_info(row)) else {
                    return Err(failed(row, batch.error(row).unwrap_or(&EnvError::EpisodeOver)));
                };
                let episode = &mut episodes[first + row];
                episode.add(batch.reward()[row], info.as_ref());
                if batch.terminated()[row] || batch.truncated()[row] {
                    *is_running = false;
                    progress(episode);
                } else if episode.episode_length >= MAX_STEPS {
                    return Err(failed(row, &EnvError::Endless { steps: MAX_STEPS }));
                }
            }
        }
    }
    Ok(Evaluation { episodes })
}

impl Episode {
    /// Starts an episode without steps.
    pub(crate) const fn new(seed: Option<u64>) -> Self {
        Self {
            seed,
            episode_return: 0.0,
            episode_length: 0,
            final_distance: f64::NAN,
            success: false,
            success_any: false,
        }
    }

    /// Adds a step.
    pub(crate) fn add(&mut self, reward: f64, info: &Info) {
        self.episode_return += reward;
        self.episode_length += 1;
        self.final_distance = info.distance;
        self.success = info.is_success;
        self.success_any |= info.is_success;
    }
}

impl Evaluation {
    /// Returns the figures over all episodes.
    ///
    /// # Errors
    /// [`EvaluationError::NoEpisodes`] if there are none, and [`EvaluationError::Statistics`] if a
    /// return or a distance is not finite.
    pub fn summary(&self) -> Result<Summary, EvaluationError> {
        if self.episodes.is_empty() {
            return Err(EvaluationError::NoEpisodes);
        }
        let count = |test: fn(&Episode) -> bool| self.episodes.iter().filter(|e| test(e)).count();
        let mean = |value: fn(&Episode) -> f64| {
            Estimate::mean(&self.episodes.iter().map(value).collect::<Vec<_>>())
        };
        let total = self.episodes.len();
        Ok(Summary {
            success_rate: Estimate::share(count(|e| e.success), total)?,
            success_any_rate: Estimate::share(count(|e| e.success_any), total)?,
            episode_return_mean: mean(|e| e.episode_return)?,
            episode_length_mean: mean(|e| e.episode_length as f64)?,
            final_distance_mean: mean(|e| e.final_distance)?,
        })
    }

    /// Returns the success rate at each of these distance thresholds: as in the environment, an
    /// episode succeeds if the distance after its last step is strictly below the threshold.
    ///
    /// # Errors
    /// [`EvaluationError::NoEpisodes`] if there are no episodes.
    pub fn success_at(&self, thresholds: &[f64]) -> Result<Vec<Estimate>, EvaluationError> {
        if self.episodes.is_empty() {
            return Err(EvaluationError::NoEpisodes);
        }
        thresholds
            .iter()
            .map(|&threshold| {
                let below = self.episodes.iter().filter(|e| e.final_distance < threshold).count();
                Ok(Estimate::share(below, self.episodes.len())?)
            })
            .collect()
    }
}
