//! Episodes spread over processes by their seeds.

use fetch_env::{ActionElement, GoalEnv, VecEnv};

use crate::evaluate::{Controls, Episode, Evaluation, EvaluationError, evaluate_range};
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
    let own = own.episodes.iter();
    let own: Vec<_> = own.map(|e| (to_message(e), e.controls.as_ref().map(to_bits))).collect();
    let all: Vec<Vec<(Message, Option<ControlBits>)>> = gather_values(workers, &own)?;
    let episode = |(message, controls): (_, Option<_>)| Episode {
        controls: controls.map(from_bits),
        ..from_message(message)
    };
    Ok(Evaluation { episodes: all.into_iter().flatten().map(episode).collect() })
}

/// The controls of an episode as they are sent: bits, like the numbers of a [`Message`].
type ControlBits = ([Vec<u64>; 2], Option<usize>, [u64; 3], Option<u64>);

fn to_bits(controls: &Controls) -> ControlBits {
    let goals = [&controls.start_goal, &controls.desired_goal];
    let numbers = [controls.action_change, controls.largest_action, controls.energy];
    (
        goals.map(|goal| goal.iter().map(|number| number.to_bits()).collect()),
        controls.steps_to_success,
        numbers.map(f64::to_bits),
        controls.path.map(f64::to_bits),
    )
}

fn from_bits((goals, steps_to_success, numbers, path): ControlBits) -> Controls {
    let [start_goal, desired_goal] =
        goals.map(|goal| goal.into_iter().map(f64::from_bits).collect());
    let [action_change, largest_action, energy] = numbers.map(f64::from_bits);
    let path = path.map(f64::from_bits);
    Controls {
        start_goal,
        desired_goal,
        steps_to_success,
        action_change,
        largest_action,
        path,
        energy,
    }
}

/// An episode without its controls as it is sent and saved. Its return and its final distance are
/// bits, because they may be infinite or NaN, which JSON lacks.
pub(crate) type Message = (Option<u64>, [u64; 2], usize, [bool; 2]);

pub(crate) fn to_message(episode: &Episode) -> Message {
    let &Episode {
        seed, episode_return, episode_length, final_distance, success, success_any, ..
    } = episode;
    let numbers = [episode_return, final_distance].map(f64::to_bits);
    (seed, numbers, episode_length, [success, success_any])
}

pub(crate) fn from_message((seed, numbers, episode_length, successes): Message) -> Episode {
    let [episode_return, final_distance] = numbers.map(f64::from_bits);
    let [success, success_any] = successes;
    let controls = None;
    Episode { seed, episode_return, episode_length, final_distance, success, success_any, controls }
}
