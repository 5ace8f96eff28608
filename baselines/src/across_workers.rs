//! Episodes spread over processes by their seeds.

use fetch_env::{ActionElement, GoalEnv, VecEnv};

use crate::evaluate::{Episode, Evaluation, EvaluationError, evaluate_range};
use crate::policy::VecPolicy;
use crate::workers::{UnreadableMessage, Workers, gather_values, share};

/// Evaluates a policy as [`evaluate_vec`](crate::evaluate_vec) does, each process on its [`share`]
/// of the seeds. All processes get all episodes, which are the same for any number of processes.
///
/// # Errors
/// As [`evaluate_vec`](crate::evaluate_vec), in the process where an episode fails, with the number
/// of the episode among all. That process does not take part in the exchange of results, which the
/// others wait for, so it must end the run. [`EvaluationError::Unreadable`] in all processes.
pub fn evaluate_across_workers<E: GoalEnv + Send + 'static>(
    workers: &mut dyn Workers,
    envs: &mut VecEnv<E>,
    policy: &mut (impl VecPolicy<E::Observation, E::Info, ActionElement<E>> + ?Sized),
    count: usize,
    first_seed: u64,
    progress: impl FnMut(&Episode),
) -> Result<Evaluation, EvaluationError> {
    let own = share(workers, count);
    let evaluation = evaluate_range(envs, policy, own, first_seed, progress, &mut || true)?;
    Ok(gather_episodes(workers, &evaluation)?)
}

/// Returns the episodes of all processes, in the order of ranks.
///
/// # Errors
/// [`UnreadableMessage`].
pub fn gather_episodes(
    workers: &mut dyn Workers,
    own: &Evaluation,
) -> Result<Evaluation, UnreadableMessage> {
    let own: Vec<_> = own.episodes.iter().map(to_message).collect();
    let all = gather_values(workers, &own)?;
    Ok(Evaluation { episodes: all.into_iter().flatten().map(from_message).collect() })
}

/// An episode as it is sent and saved. Its return and its final distance are bits, because they may
/// be infinite or NaN, which JSON lacks.
pub(crate) type Message = (Option<u64>, [u64; 2], usize, [bool; 2]);

pub(crate) fn to_message(episode: &Episode) -> Message {
    let &Episode { seed, episode_return, episode_length, final_distance, success, success_any } =
        episode;
    let numbers = [episode_return, final_distance].map(f64::to_bits);
    (seed, numbers, episode_length, [success, success_any])
}

pub(crate) fn from_message((seed, numbers, episode_length, successes): Message) -> Episode {
    let [episode_return, final_distance] = numbers.map(f64::from_bits);
    let [success, success_any] = successes;
    Episode { seed, episode_return, episode_length, final_distance, success, success_any }
}
