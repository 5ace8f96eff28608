//! Evaluation of a policy over seeded episodes.

mod episode;
mod strata;
mod summary;

use std::ops::Range;

use fetch_env::vec_env::VecReset;
use fetch_env::{
    ActionElement, ActionSpace, Env, EnvError, GoalEnv, GoalObservation, Reset, Step, VecEnv,
};

use self::episode::Measured;
pub use self::{
    episode::{Controls, Episode},
    strata::{strata_of, stratum},
    summary::{ControlSummary, Evaluation, EvaluationError, Summary},
};
use crate::policy::{Policy, PolicyError, VecPolicy};

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
    finish_episode(env, policy, start.observation, Some(seed), failed, watch)
}

/// Continues an episode of a seed from an observation, as [`run_episode`] does.
pub(crate) fn finish_episode<E: GoalEnv, X>(
    env: &mut E,
    policy: &mut (impl Policy<E::Observation, ActionElement<E>> + ?Sized),
    mut observation: E::Observation,
    seed: Option<u64>,
    failed: impl Fn(EnvError) -> X,
    mut watch: impl FnMut(&E, Event<'_, E>) -> Result<(), X>,
) -> Result<Episode, X> {
    let mut episode = Measured::<E::Observation>::start(
        seed,
        observation.achieved_goal(),
        observation.desired_goal(),
        observation.observation(),
    );
    let mut action = vec![ActionElement::<E>::default(); env.action_space().action_len()];
    loop {
        policy.act(&observation, &mut action);
        let step = env.step(&action).map_err(&failed)?;
        watch(env, Event::Step(&action, &step))?;
        let is_last = step.is_last();
        let row = step.observation.observation();
        episode.add(&action, row, step.reward, step.info.as_ref());
        if is_last {
            return Ok(episode.finish());
        }
        if episode.len() >= MAX_STEPS {
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
        let number = range.start + episodes.len();
        let size = num_envs.min(range.len() - episodes.len());
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
        let batch = envs.reset_with(&reset)?;
        if let Some((row, error)) = batch.errors().find(|(row, _)| *row < size) {
            return Err(failed(row, error));
        }
        let observation_len = batch.observation().len() / num_envs;
        let goal_len = batch.desired_goal().len() / num_envs;
        let mut finished = vec![None; size];
        let mut running: Vec<_> = (0..size)
            .map(|row| {
                Some(Measured::<E::Observation>::start(
                    seeds[row],
                    &batch.achieved_goal()[row * goal_len..][..goal_len],
                    &batch.desired_goal()[row * goal_len..][..goal_len],
                    &batch.observation()[row * observation_len..][..observation_len],
                ))
            })
            .collect();
        while running.iter().any(Option::is_some) {
            if !go_on() {
                return Err(EvaluationError::Stopped);
            }
            policy.act_all(envs.last_step(), &mut actions);
            let batch = envs.step(&actions)?;
            for (row, slot) in running.iter_mut().enumerate() {
                let Some(episode) = slot else { continue };
                let (true, Some(info)) = (batch.stepped()[row], batch.step_info(row)) else {
                    return Err(failed(row, batch.error(row).unwrap_or(&EnvError::EpisodeOver)));
                };
                episode.add(
                    &batch.action()[row * len..][..len],
                    &batch.next_observation()[row * observation_len..][..observation_len],
                    batch.reward()[row],
                    info.as_ref(),
                );
                if batch.terminated()[row] || batch.truncated()[row] {
                    let episode = slot.take().map(Measured::finish);
                    episode.iter().for_each(&mut progress);
                    finished[row] = episode;
                } else if episode.len() >= MAX_STEPS {
                    return Err(failed(row, &EnvError::Endless { steps: MAX_STEPS }));
                }
            }
        }
        episodes.extend(finished.into_iter().flatten());
    }
    Ok(Evaluation { episodes })
}
