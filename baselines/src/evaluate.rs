//! Evaluation of a policy over seeded episodes.

use fetch_env::{EnvError, FetchObservation, GoalEnv, Info, Reset, Step};
use serde::{Deserialize, Serialize};

use crate::{
    error::EvaluationError,
    policy::{Action, Policy},
    statistics::Estimate,
};

/// The result of one episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Episode {
    /// Seed of the reset.
    pub seed: u64,
    /// Sum of the rewards.
    pub return_sum: f64,
    /// Number of steps.
    pub length: usize,
    /// Distance between achieved and desired goal after the last step, in meters.
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
    pub return_mean: Estimate,
    /// Mean number of steps.
    pub ep_len_mean: Estimate,
    /// Mean distance at the end, in meters.
    pub final_distance_mean: Estimate,
}

/// Runs `count` episodes, reset with the seeds `first_seed`, `first_seed + 1`, ..., each until it
/// is terminated or truncated, and calls `progress` after each.
///
/// # Errors
/// [`EvaluationError::Environment`] if a reset or a step fails.
pub fn evaluate<E, P>(
    env: &mut E,
    policy: &mut P,
    count: usize,
    first_seed: u64,
    mut progress: impl FnMut(&Episode),
) -> Result<Evaluation, EvaluationError>
where
    E: GoalEnv<Observation = FetchObservation>,
    P: Policy + ?Sized,
{
    let mut episodes = Vec::with_capacity(count);
    for (episode, seed) in (0..count).zip(first_seed..) {
        let failed = |source| EvaluationError::Environment { episode, seed, source };
        let result = run_episode(env, policy, seed, failed, |_, _| Ok(()))?;
        progress(&result);
        episodes.push(result);
    }
    Ok(Evaluation { episodes })
}

/// An event of an episode.
pub(crate) enum Event<'a> {
    Start(&'a Reset<FetchObservation, Info>),
    Step(&'a Action, &'a Step<FetchObservation, Info>),
}

/// Runs an episode until it is terminated or truncated, and calls `watch` with the environment after
/// each event. `failed` converts the environment's errors.
pub(crate) fn run_episode<E, P, X>(
    env: &mut E,
    policy: &mut P,
    seed: u64,
    failed: impl Fn(EnvError) -> X,
    mut watch: impl FnMut(&E, Event<'_>) -> Result<(), X>,
) -> Result<Episode, X>
where
    E: GoalEnv<Observation = FetchObservation>,
    P: Policy + ?Sized,
{
    policy.reset();
    let start = env.reset(Some(seed)).map_err(&failed)?;
    watch(env, Event::Start(&start))?;
    let mut observation = start.observation;
    let mut episode = Episode {
        seed,
        return_sum: 0.0,
        length: 0,
        final_distance: f64::NAN,
        success: false,
        success_any: false,
    };
    loop {
        let action = policy.act(&observation);
        let step = env.step(&action).map_err(&failed)?;
        watch(env, Event::Step(&action, &step))?;
        observation = step.observation;
        episode.return_sum += step.reward;
        episode.length += 1;
        episode.final_distance = step.info.distance;
        episode.success = step.info.is_success;
        episode.success_any |= step.info.is_success;
        if step.is_last() {
            return Ok(episode);
        }
    }
}

impl Evaluation {
    /// Returns the figures over all episodes.
    ///
    /// # Errors
    /// [`EvaluationError::NoEpisodes`] if there are none.
    pub fn summary(&self) -> Result<Summary, EvaluationError> {
        let count = |test: fn(&Episode) -> bool| self.episodes.iter().filter(|e| test(e)).count();
        let mean = |value: fn(&Episode) -> f64| {
            Estimate::mean(&self.episodes.iter().map(value).collect::<Vec<_>>())
        };
        let total = self.episodes.len();
        Ok(Summary {
            success_rate: Estimate::share(count(|e| e.success), total)?,
            success_any_rate: Estimate::share(count(|e| e.success_any), total)?,
            return_mean: mean(|e| e.return_sum)?,
            ep_len_mean: mean(|e| e.length as f64)?,
            final_distance_mean: mean(|e| e.final_distance)?,
        })
    }

    /// Returns the success rate at each of other distance thresholds (meters): as in the
    /// environment, an episode succeeds if the distance after its last step is strictly below the
    /// threshold.
    ///
    /// # Errors
    /// [`EvaluationError::NoEpisodes`] if there are no episodes.
    pub fn success_at(&self, thresholds: &[f64]) -> Result<Vec<Estimate>, EvaluationError> {
        thresholds
            .iter()
            .map(|&threshold| {
                let below = self.episodes.iter().filter(|e| e.final_distance < threshold).count();
                Estimate::share(below, self.episodes.len())
            })
            .collect()
    }
}
