//! Adding a step of every environment at once.

use crate::add::arguments::{AddError, EpisodeStart, Step, check, check_len};
use crate::store::fields::FieldRows;
use crate::{HerBuffer, Scalar};

/// The first states of new episodes: row `i` is environment `i`, row-major, one row for each
/// environment of the buffer.
#[derive(Clone, Copy, Debug)]
pub struct StartBatch<'a, S> {
    /// The observations, `n_envs * dims.observation` elements.
    pub observations: &'a [S],
    /// The goals achieved in these states, `n_envs * dims.goal` elements.
    pub achieved_goals: &'a [S],
    /// The goals of the whole episodes, `n_envs * dims.goal` elements.
    pub desired_goals: &'a [S],
}

/// A step of all environments: row `i` is environment `i`, row-major.
///
/// # Example
/// Two environments, of which the first one ends and begins anew.
/// ```
/// use her_relabel::{BufferConfig, Dims, HerBuffer, StartBatch, StepBatch};
///
/// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
/// let mut buffer = HerBuffer::<f32>::new(config.with_n_envs(2))?;
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
    /// The actions taken, `n_envs * dims.action` elements.
    pub actions: &'a [S],
    /// The rewards for the episodes' own goals, `n_envs` elements.
    pub rewards: &'a [S],
    /// The observations after the step: of an episode that ends its terminal observation, which
    /// vectorized environments often return apart. `n_envs * dims.observation` elements.
    pub next_observations: &'a [S],
    /// The goals achieved after the step, `n_envs * dims.goal` elements.
    pub next_achieved_goals: &'a [S],
    /// Where the task is over, `n_envs`.
    pub terminated: &'a [bool],
    /// Where the episode was cut off, `n_envs`.
    pub truncated: &'a [bool],
    /// The first states of the episodes that follow those which end here. Only the rows of these are
    /// looked at. With `None` they wait for [`HerBuffer::begin_episode`].
    pub next_starts: Option<StartBatch<'a, S>>,
    /// The fields of the configuration, by name, in any order; `n_envs * len` elements each.
    pub fields: &'a [FieldRows<'a, S>],
}

impl<T: Scalar> HerBuffer<T> {
    /// Begins an episode of every environment, after the reset of all.
    ///
    /// # Errors
    /// [`AddError::EpisodeUnderWay`], or what is wrong with a state; nothing has begun then.
    pub fn begin_episodes<S: Scalar>(
        &mut self,
        starts: &StartBatch<'_, S>,
    ) -> Result<(), AddError> {
        self.check_starts(starts)?;
        for env in 0..self.config.n_envs {
            if self.check_recording(env).is_ok() {
                return Err(AddError::EpisodeUnderWay { env });
            }
            self.start(starts, env).check::<T>(&self.storage.layout)?;
        }
        for env in 0..self.config.n_envs {
            self.begin_episode(env, &self.start(starts, env))?;
        }
        Ok(())
    }

    /// Adds a step of every environment. Where it ends an episode, the transitions of that can be
    /// sampled from then on, and the next one begins.
    ///
    /// # Errors
    /// [`AddError::NoEpisode`], or what is wrong with a row; nothing has been added then.
    pub fn add_steps<S: Scalar>(&mut self, steps: &StepBatch<'_, S>) -> Result<(), AddError> {
        self.check_steps(steps)?;
        for env in 0..self.config.n_envs {
            self.record(env, &self.step(steps, env), env);
            if let Some(starts) = steps.next_starts.filter(|_| steps.ends(env)) {
                self.begin_episode(env, &self.start(&starts, env))?;
            }
        }
        Ok(())
    }

    fn check_starts<S: Scalar>(&self, starts: &StartBatch<'_, S>) -> Result<(), AddError> {
        let (n_envs, dims) = (self.config.n_envs, self.config.dims);
        let goals = n_envs.saturating_mul(dims.goal);
        let observations = n_envs.saturating_mul(dims.observation);
        check_len("observations", starts.observations.len(), observations)?;
        check_len("achieved_goals", starts.achieved_goals.len(), goals)?;
        check_len("desired_goals", starts.desired_goals.len(), goals)
    }

    fn check_steps<S: Scalar>(&self, steps: &StepBatch<'_, S>) -> Result<(), AddError> {
        let (n_envs, dims) = (self.config.n_envs, self.config.dims);
        let size = |len: usize| n_envs.saturating_mul(len);
        check::<T, S>("actions", steps.actions, size(dims.action))?;
        check::<T, S>("rewards", steps.rewards, n_envs)?;
        check::<T, S>("next_observations", steps.next_observations, size(dims.observation))?;
        check::<T, S>("next_achieved_goals", steps.next_achieved_goals, size(dims.goal))?;
        check_len("terminated", steps.terminated.len(), n_envs)?;
        check_len("truncated", steps.truncated.len(), n_envs)?;
        self.storage.fields.check::<T, S>(steps.fields, n_envs)?;
        if let Some(starts) = &steps.next_starts {
            self.check_starts(starts)?;
            for env in (0..n_envs).filter(|env| steps.ends(*env)) {
                self.start(starts, env).check::<T>(&self.storage.layout)?;
            }
        }
        (0..n_envs).try_for_each(|env| self.check_recording(env))
    }

    /// Row `env` of the starts.
    fn start<'a, S>(&self, starts: &StartBatch<'a, S>, env: usize) -> EpisodeStart<'a, S> {
        let dims = self.config.dims;
        EpisodeStart {
            observation: row(starts.observations, env, dims.observation),
            achieved_goal: row(starts.achieved_goals, env, dims.goal),
            desired_goal: row(starts.desired_goals, env, dims.goal),
        }
    }

    /// Row `env` of the steps, with the fields of all rows.
    fn step<'a, S: Scalar>(&self, steps: &StepBatch<'a, S>, env: usize) -> Step<'a, S> {
        let dims = self.config.dims;
        Step {
            action: row(steps.actions, env, dims.action),
            reward: steps.rewards[env],
            next_observation: row(steps.next_observations, env, dims.observation),
            next_achieved_goal: row(steps.next_achieved_goals, env, dims.goal),
            terminated: steps.terminated[env],
            truncated: steps.truncated[env],
            fields: steps.fields,
        }
    }
}

impl<S> StepBatch<'_, S> {
    fn ends(&self, env: usize) -> bool {
        self.terminated[env] || self.truncated[env]
    }
}

fn row<S>(matrix: &[S], at: usize, len: usize) -> &[S] {
    &matrix[at * len..][..len]
}
