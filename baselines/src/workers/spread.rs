//! Episodes spread over processes by their seeds.

use fetch_env::vec_env::{BatchEnv, BatchOf};
use fetch_env::{ActionElement, GoalEnv, VecEnv};

use super::{Workers, share};
use crate::error::EvaluationError;
use crate::evaluate::{Episode, Evaluation, evaluate_vec};
use crate::policy::Policy;

/// Evaluates a policy as [`evaluate_vec`] does, each process on its [`share`] of the seeds. All get the
/// episodes of all, the same for any number of processes.
///
/// # Errors
/// As [`evaluate_vec`], in the process where it happens. That process does not take part in the
/// exchange of results, for which the others then wait: it has to end the run.
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
    P: Policy<BatchOf<E>, ActionElement<E>> + ?Sized,
{
    let own = share(workers, count);
    let own_seed = first_seed.wrapping_add(own.start as u64);
    let evaluation = evaluate_vec(envs, policy, own.len(), own_seed, progress)?;
    Ok(gather_episodes(workers, &evaluation))
}

/// Returns the episodes of all processes, in the order of ranks.
pub fn gather_episodes(workers: &mut dyn Workers, own: &Evaluation) -> Evaluation {
    let message: Vec<u8> = own.episodes.iter().flat_map(to_bytes).collect();
    let messages = workers.gather(&message);
    let rows = messages.iter().flat_map(|message| message.as_chunks().0);
    Evaluation { episodes: rows.map(from_bytes).collect() }
}

/// The numbers of an episode, each of 8 bytes. JSON has no numbers that are not finite.
const LEN: usize = 5 * 8;

fn to_bytes(episode: &Episode) -> [u8; LEN] {
    let flags = [episode.seed.is_some(), episode.success, episode.success_any];
    let flags = flags.iter().rev().fold(0, |bits, flag| bits << 1 | u64::from(*flag));
    let words = [
        flags,
        episode.seed.unwrap_or_default(),
        episode.return_sum.to_bits(),
        episode.length as u64,
        episode.final_distance.to_bits(),
    ];
    let mut bytes = [0; LEN];
    for (bytes, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
        *bytes = word.to_le_bytes();
    }
    bytes
}

fn from_bytes(bytes: &[u8; LEN]) -> Episode {
    let word =
        |index: usize| bytes.as_chunks().0.get(index).map_or(0, |word| u64::from_le_bytes(*word));
    let flag = |bit: u32| word(0) >> bit & 1 == 1;
    Episode {
        seed: flag(0).then(|| word(1)),
        return_sum: f64::from_bits(word(2)),
        length: word(3) as usize,
        final_distance: f64::from_bits(word(4)),
        success: flag(1),
        success_any: flag(2),
    }
}
