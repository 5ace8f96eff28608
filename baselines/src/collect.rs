//! Collects episodes of a policy into a hindsight replay buffer.

use fetch_env::spaces::SpaceError;
use fetch_env::{
    ActionElement, ActionSpace, EnvError, GoalEnv, GoalEnvExt, GoalObservation, Reset,
};
use her_relabel::{AddError, BufferConfig, HerBuffer, Scalar, StartData, StepData};

use crate::evaluate::{Episode, Evaluation, Event, check_policy, run_episode, seeds};
use crate::policy::{Policy, PolicyError};

/// Error returned by [`collect`].
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum CollectError {
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
    /// The buffer rejected an episode.
    #[error("the buffer rejected episode {episode} (seed {seed})")]
    Buffer {
        /// The episode, counted from 0.
        episode: usize,
        /// The seed of its reset.
        seed: u64,
        /// The buffer's error.
        source: AddError,
    },
}

debug_as_display!(CollectError);

/// Returns the configuration of a buffer that holds `capacity` transitions of an environment.
///
/// # Errors
/// [`SpaceError::MissingPart`] if the environment's observation space has no observation or no
/// goals.
pub fn buffer_config<E: GoalEnv>(capacity: usize, env: &E) -> Result<BufferConfig, SpaceError> {
    Ok(BufferConfig::new(capacity, env.dims()?))
}

/// Runs `count` episodes, reset with the seeds `first_seed`, `first_seed + 1`, ..., each until it
/// is terminated or truncated, adds them to a buffer as episodes of its environment `buffer_env`,
/// and calls `progress` after each. Returns the results of the episodes.
///
/// The buffer also gets the terminal observation of each, and `terminated` and `truncated` as the
/// environment sets them.
///
/// # Errors
/// [`CollectError`]. The buffer then holds the episodes before the one that failed.
pub fn collect<E, T: Scalar>(
    env: &mut E,
    policy: &mut (impl Policy<E::Observation, ActionElement<E>> + ?Sized),
    count: usize,
    first_seed: u64,
    buffer: &mut HerBuffer<T>,
    buffer_env: usize,
    mut progress: impl FnMut(&Episode),
) -> Result<Evaluation, CollectError>
where
    E: GoalEnv<
            Observation: GoalObservation<Element: Scalar>,
            ActionSpace: ActionSpace<Element: Scalar>,
        >,
{
    check_policy(env, policy)?;
    let mut episodes = Vec::new();
    for (episode, seed) in (0..count).zip(seeds(first_seed)) {
        let failed = |source| CollectError::Environment { episode, seed, source };
        let result = run_episode(env, policy, seed, failed, |_, event| {
            let added = match event {
                Event::Start(Reset { observation, .. }) => {
                    // If an episode is under way there, it is cut off.
                    let _ = buffer.end_episode(buffer_env);
                    let start = StartData {
                        observation: observation.observation(),
                        achieved_goal: observation.achieved_goal(),
                        desired_goal: observation.desired_goal(),
                    };
                    buffer.begin_episode(buffer_env, &start)
                }
                Event::Step(action, step) => {
                    let observation = &step.observation;
                    let step = StepData {
                        action,
                        reward: step.reward,
                        next_observation: observation.observation(),
                        next_achieved_goal: observation.achieved_goal(),
                        terminated: step.terminated,
                        truncated: step.truncated,
                        fields: &[],
                    };
                    let desired_goal = observation.desired_goal();
                    buffer
                        .set_desired_goal(buffer_env, desired_goal)
                        .and_then(|_| buffer.add_step(buffer_env, &step))
                }
            };
            added.map_err(|source| CollectError::Buffer { episode, seed, source })
        });
        if result.is_err() {
            // Whether an episode was under way does not matter.
            let _ = buffer.discard_episode(buffer_env);
        }
        let result = result?;
        progress(&result);
        episodes.push(result);
    }
    Ok(Evaluation { episodes })
}
