//! Episodes spread over processes by their seeds.

use fetch_env::vec_env::{BatchEnv, VecStepOf};
use fetch_env::{ActionElement, GoalEnv, VecEnv};

use crate::error::EvaluationError;
use crate::evaluate::{Episode, Evaluation, evaluate_range};
use crate::policy::Policy;
use crate::workers::{UnreadableMessage, Workers, share};

/// Evaluates a policy as [`evaluate_vec`](crate::evaluate_vec) does, each process on its [`share`]
/// of the seeds. All get the episodes of all, the same for any number of processes.
///
/// # Errors
/// As [`evaluate_vec`](crate::evaluate_vec), in the process where it happens, with the number of
/// the episode among all. That process does not take part in the exchange of results, for which the
/// others then wait: it has to end the run. [`EvaluationError::Unreadable`] in all processes.
pub fn evaluate_spread<E, P>(
    workers: &mut dyn Workers,
    envs: &mut VecEnv<E>,
    policy: &mut P,
    count: usize,
    first_seed: u64,
    progress: impl FnMut(&Episode),
) -> Result<Evaluation, EvaluationError>
where
    E: BatchEnv + GoalEnv,
    P: Policy<VecStepOf<E>, ActionElement<E>> + ?Sized,
{
    let own = share(workers, count);
    let evaluation = evaluate_range(envs, policy, own, first_seed, progress)?;
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
    // JSON has no numbers that are not finite, which an episode may have.
    let message: Vec<u8> =
        own.episodes.iter().flat_map(to_words).flat_map(u64::to_le_bytes).collect();
    let mut episodes = Vec::new();
    for (rank, message) in workers.gather(&message).iter().enumerate() {
        let (words, rest) = message.as_chunks();
        let words: Vec<_> = words.iter().copied().map(u64::from_le_bytes).collect();
        let (rows, more) = words.as_chunks();
        if !rest.is_empty() || !more.is_empty() {
            let reason = format!("{} bytes are not those of whole episodes", message.len());
            return Err(UnreadableMessage { rank, reason });
        }
        episodes.extend(rows.iter().copied().map(from_words));
    }
    Ok(Evaluation { episodes })
}

fn to_words(episode: &Episode) -> [u64; 5] {
    let flags = [episode.seed.is_some(), episode.success, episode.success_any];
    [
        flags.iter().rev().fold(0, |bits, flag| bits << 1 | u64::from(*flag)),
        episode.seed.unwrap_or_default(),
        episode.episode_return.to_bits(),
        episode.episode_length as u64,
        episode.final_distance.to_bits(),
    ]
}

const fn from_words(
    [flags, seed, episode_return, episode_length, final_distance]: [u64; 5],
) -> Episode {
    let [has_seed, success, success_any] = [flags & 1 != 0, flags & 2 != 0, flags & 4 != 0];
    Episode {
        seed: if has_seed { Some(seed) } else { None },
        episode_return: f64::from_bits(episode_return),
        episode_length: episode_length as usize,
        final_distance: f64::from_bits(final_distance),
        success,
        success_any,
    }
}
