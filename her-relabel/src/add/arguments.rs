//! The arguments of adding: starts, steps and episodes, of one environment or of all.

use crate::store::config::Dims;

/// The name of a field and its numbers: `len` of them for one step, and a row-major matrix with `len`
/// columns for several.
pub type FieldRows<'a, S> = (&'a str, &'a [S]);

/// The first state of an episode, and the episode's goal.
///
/// `S` is `f32` or `f64`, independent of the type that the buffer stores.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeStart<'a, S> {
    /// The observation, `dims.observation` elements.
    pub observation: &'a [S],
    /// The goal achieved in this state, `dims.goal` elements.
    pub achieved_goal: &'a [S],
    /// The goal of the whole episode, `dims.goal` elements.
    pub desired_goal: &'a [S],
}

/// One step of an environment.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a, S> {
    /// The action taken, `dims.action` elements.
    pub action: &'a [S],
    /// The reward for the episode's own goal.
    pub reward: S,
    /// The observation after the step, `dims.observation` elements: at an episode's end its terminal
    /// observation, never the first one of the next episode.
    pub next_observation: &'a [S],
    /// The goal achieved after the step, `dims.goal` elements.
    pub next_achieved_goal: &'a [S],
    /// Whether the task ended here, so that there is no later reward.
    pub terminated: bool,
    /// Whether the episode was cut off here, by a time limit for example, although the task goes on.
    pub truncated: bool,
    /// The fields of the configuration, by name, in any order.
    pub fields: &'a [FieldRows<'a, S>],
}

/// A whole episode of `T` steps and `T + 1` states, in row-major matrices.
#[derive(Clone, Copy, Debug)]
pub struct EpisodeData<'a, S> {
    /// The observations of states `0..=T`, `(T + 1) * dims.observation` elements.
    pub observations: &'a [S],
    /// The goals achieved in states `0..=T`, `(T + 1) * dims.goal` elements.
    pub achieved_goals: &'a [S],
    /// The goal of the episode, `dims.goal` elements.
    pub desired_goal: &'a [S],
    /// The actions, `T * dims.action` elements.
    pub actions: &'a [S],
    /// The rewards for the episode's own goal, `T` elements. Their number determines `T`.
    pub rewards: &'a [S],
    /// Whether the last step ended the task.
    pub terminated: bool,
    /// Whether the episode was cut off after the last step.
    pub truncated: bool,
    /// The fields of the configuration, by name, in any order; `T * len` elements each.
    pub fields: &'a [FieldRows<'a, S>],
}

/// The first states of new episodes: row-major, one row for each environment of the buffer.
#[derive(Clone, Copy, Debug)]
pub struct StartBatch<'a, S> {
    /// The observations, `num_envs * dims.observation` elements.
    pub observations: &'a [S],
    /// The goals achieved in these states, `num_envs * dims.goal` elements.
    pub achieved_goals: &'a [S],
    /// The goals of the whole episodes, `num_envs * dims.goal` elements.
    pub desired_goals: &'a [S],
}

impl<'a, S> StartBatch<'a, S> {
    /// Returns the row of environment `env`.
    pub(crate) fn row(&self, env: usize, dims: Dims) -> EpisodeStart<'a, S> {
        EpisodeStart {
            observation: row(self.observations, env, dims.observation),
            achieved_goal: row(self.achieved_goals, env, dims.goal),
            desired_goal: row(self.desired_goals, env, dims.goal),
        }
    }
}

/// A step of all environments: row-major, one row for each environment.
///
/// # Example
/// Two environments, of which the first one ends its episode and begins another.
/// ```
/// use her_relabel::{BufferConfig, Dims, HerBuffer, StartBatch, StepBatch};
///
/// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
/// let mut buffer = HerBuffer::<f32>::new(config.with_num_envs(2))?;
/// let starts = StartBatch {
///     observations: &[0.0, 0.0],
///     achieved_goals: &[0.0, 0.0],
///     desired_goals: &[5.0, 6.0],
/// };
/// buffer.begin_episodes(&starts)?;
/// buffer.add_steps(&StepBatch {
///     actions: &[1.0, 1.0],
///     rewards: &[-1.0, -1.0],
///     next_observations: &[1.0, 1.0],
///     next_achieved_goals: &[1.0, 1.0],
///     terminated: &[false, false],
///     truncated: &[true, false],
///     next_starts: Some(starts),
///     fields: &[],
/// })?;
/// assert_eq!(buffer.len(), 1);
/// assert_eq!(buffer.unfinished_steps(0)?, Some(0));
/// assert_eq!(buffer.unfinished_steps(1)?, Some(1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct StepBatch<'a, S> {
    /// The actions taken, `num_envs * dims.action` elements.
    pub actions: &'a [S],
    /// The rewards for the episodes' own goals, `num_envs` elements.
    pub rewards: &'a [S],
    /// The observations after the step, `num_envs * dims.observation` elements: of an episode that ends its
    /// terminal observation, which vectorized environments often return separately.
    pub next_observations: &'a [S],
    /// The goals achieved after the step, `num_envs * dims.goal` elements.
    pub next_achieved_goals: &'a [S],
    /// Whether each task ended, `num_envs` elements.
    pub terminated: &'a [bool],
    /// Whether each episode was cut off, `num_envs` elements.
    pub truncated: &'a [bool],
    /// The first states of the episodes that follow those ending here. Only the rows of environments whose
    /// episode ends are read. With `None`, these environments wait for
    /// [`HerBuffer::begin_episode`](crate::HerBuffer::begin_episode).
    pub next_starts: Option<StartBatch<'a, S>>,
    /// The fields of the configuration, by name, in any order; `num_envs * len` elements each.
    pub fields: &'a [FieldRows<'a, S>],
}

impl<'a, S: Copy> StepBatch<'a, S> {
    /// Returns the row of environment `env`, with the fields of all rows.
    pub(crate) fn row(&self, env: usize, dims: Dims) -> Step<'a, S> {
        Step {
            action: row(self.actions, env, dims.action),
            reward: self.rewards[env],
            next_observation: row(self.next_observations, env, dims.observation),
            next_achieved_goal: row(self.next_achieved_goals, env, dims.goal),
            terminated: self.terminated[env],
            truncated: self.truncated[env],
            fields: self.fields,
        }
    }

    /// Whether the episode of environment `env` ends.
    pub(crate) fn ends(&self, env: usize) -> bool {
        self.terminated[env] || self.truncated[env]
    }
}

fn row<S>(matrix: &[S], at: usize, len: usize) -> &[S] {
    &matrix[at * len..][..len]
}
