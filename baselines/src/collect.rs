//! Episodes of a policy, collected into a hindsight replay buffer.

use fetch_env::{EnvError, FetchObservation, GoalEnv, GoalObservation};
use her_relabel::{AddError, BufferConfig, Dims, EpisodeStart, HerBuffer, Scalar, Step};

use crate::{
    error::CollectError,
    evaluate::{Evaluation, Event, run_episode},
    policy::{Action, Policy},
};

/// Returns the configuration of a buffer that holds `capacity` transitions, of an environment with
/// observations of this size.
pub fn buffer_config(capacity: usize, observation: &FetchObservation) -> BufferConfig {
    let dims = Dims {
        observation: observation.observation().len(),
        goal: observation.desired_goal().len(),
        action: size_of::<Action>() / size_of::<f32>(),
    };
    BufferConfig::new(capacity, dims)
}

/// Runs `count` episodes, reset with the seeds `first_seed`, `first_seed + 1`, ..., each until it is
/// terminated or truncated, and adds them to a buffer as its environment `buffer_env`. Returns the
/// results of the episodes.
///
/// The buffer also gets the terminal observation of each, and `terminated` and `truncated` as the
/// environment sets them.
///
/// # Errors
/// [`CollectError`]. The buffer then holds the episodes before the one that failed.
pub fn collect<E, P, T>(
    env: &mut E,
    policy: &mut P,
    count: usize,
    first_seed: u64,
    buffer: &mut HerBuffer<T>,
    buffer_env: usize,
) -> Result<Evaluation, CollectError>
where
    E: GoalEnv<Observation = FetchObservation>,
    P: Policy + ?Sized,
    T: Scalar,
{
    let mut episodes = Vec::with_capacity(count);
    for (episode, seed) in (0..count).zip(first_seed..) {
        let mut has_begun = false;
        let result = run_episode(env, policy, seed, |_, event| {
            match event {
                Event::Start(reset) => {
                    let start = EpisodeStart {
                        observation: reset.observation.observation(),
                        achieved_goal: reset.observation.achieved_goal(),
                        desired_goal: reset.observation.desired_goal(),
                    };
                    buffer.begin_episode(buffer_env, &start)?;
                }
                Event::Step(action, step) => {
                    let step = Step {
                        action: &action.map(f64::from),
                        reward: step.reward,
                        next_observation: step.observation.observation(),
                        next_achieved_goal: step.observation.achieved_goal(),
                        terminated: step.terminated,
                        truncated: step.truncated,
                        fields: &[],
                    };
                    buffer.add_step(buffer_env, &step)?;
                }
            }
            has_begun = true;
            Ok(())
        });
        match result {
            Ok(result) => episodes.push(result),
            Err(source) => {
                if has_begun {
                    // This cannot fail, because an episode has begun.
                    let _ = buffer.discard_episode(buffer_env);
                }
                return Err(match source {
                    Source::Environment(source) => {
                        CollectError::Environment { episode, seed, source }
                    }
                    Source::Buffer(source) => CollectError::Buffer { episode, seed, source },
                });
            }
        }
    }
    Ok(Evaluation { episodes })
}

/// The source of an episode's failure.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
enum Source {
    Environment(#[from] EnvError),
    Buffer(#[from] AddError),
}
