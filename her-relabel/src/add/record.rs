//! Recording the rows of vectorized environments.

use crate::add::arguments::FieldRows;
use crate::add::check::{AddError, check_fields, check_len};
use crate::add::row::{StartRow, StepRow};
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;
use crate::store::config::Dims;

/// Rows of vectorized environments, for [`HerBuffer::record`]: row-major, `n` rows each, one row
/// for each of the `n` environments in `env_index`.
///
/// A row may hold a step, the start of an episode, or both. The three autoreset modes of Gymnasium
/// differ in when an episode that follows another one starts:
///
/// | mode | `started` is set |
/// |---|---|
/// | next step | in the row after the episode's last step, whose own `stepped` is not set |
/// | same step | in the row of the last step of the episode before |
/// | disabled | in the row of the reset, which the caller asks for |
///
/// `O` is the type of observations, `G` that of goals, rewards and fields, and `A` that of actions:
/// `f32` or `f64`, independent of each other and of the type that the buffer stores.
///
/// Only the columns that some row needs must have `n` rows: without a start, those of starts may be
/// empty, and without a step, those of steps. [`Default`] has no rows.
#[derive(Debug)]
pub struct StepRows<'a, O, G = O, A = O> {
    /// The environment of each row, `n` elements: in any order, none twice.
    pub env_index: &'a [usize],
    /// Whether the row holds a step, `n` elements. Not set for a reset, for an environment that
    /// failed, and for one that refused its action.
    pub stepped: &'a [bool],
    /// Whether an episode starts in the row, by a reset that was asked for or an automatic one, `n`
    /// elements.
    pub started: &'a [bool],
    /// The actions taken, `n * dims.action` elements. Read in rows with a step.
    pub action: &'a [A],
    /// The rewards for the episodes' own goals, `n` elements of at most 1e20 in magnitude. Read in
    /// rows with a step.
    pub reward: &'a [G],
    /// The observations after the step, `n * dims.observation` elements: at an episode's end its
    /// terminal observation, never the first one of the next episode. Read in rows with a step.
    pub next_observation: &'a [O],
    /// The goals achieved after the step, `n * dims.goal` elements. Read in rows with a step.
    pub next_achieved_goal: &'a [G],
    /// Whether the task ended with the step, `n` elements. Read in rows with a step.
    pub terminated: &'a [bool],
    /// Whether the episode was cut off after the step, `n` elements. In a row without a step,
    /// whether the environment failed in the middle of its episode.
    pub truncated: &'a [bool],
    /// The first observations of episodes, `n * dims.observation` elements. Read in rows with a
    /// start.
    pub observation: &'a [O],
    /// The goals achieved in these states, `n * dims.goal` elements. Read in rows with a start.
    pub achieved_goal: &'a [G],
    /// The goals of the episodes that start, `n * dims.goal` elements. Read in rows with a start.
    pub desired_goal: &'a [G],
    /// The fields of the configuration, by name, in any order; `n * len` elements each. Read in
    /// rows with a step.
    pub fields: &'a [FieldRows<'a, G>],
}

/// The result of [`HerBuffer::record`]. Every row with a step is either recorded or skipped.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Recorded {
    /// The number of steps added to episodes.
    pub recorded_steps: usize,
    /// The number of steps that were not added, because their environment had no episode under way
    /// or the buffer cannot store their numbers.
    pub skipped_steps: usize,
    /// The number of episodes that ended with at least one step. They can now be sampled, but for
    /// [still ones](crate::StillEpisodes) that the buffer does not keep.
    pub finished_episodes: usize,
    /// The number of unfinished episodes that were discarded, because their environment failed or
    /// the buffer cannot store one of their steps.
    pub discarded_episodes: usize,
    /// The first row whose numbers the buffer cannot store.
    pub first_refusal: Option<RefusedRow>,
}

/// A row whose numbers the buffer cannot store.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RefusedRow {
    /// The environment.
    pub env_index: usize,
    /// The first number that cannot be stored, by its place in the row.
    pub error: AddError,
}

impl<T: Scalar> HerBuffer<T> {
    /// Records rows of vectorized environments, in any autoreset mode: of all environments, or of
    /// those that an asynchronous vectorization has received. After a reset of environments, pass
    /// rows in which episodes start; after that, every batch of rows.
    ///
    /// Each row is recorded in this order:
    /// 1. A step is added to the environment's episode, which it ends if it is terminated or
    ///    truncated. Without an episode under way, because recording began in its middle or it was
    ///    discarded, the step is skipped.
    /// 2. A row without a step that is truncated belongs to an environment that failed: its
    ///    unfinished episode is discarded.
    /// 3. Where an episode starts, one that is still under way ends as truncated with the steps it
    ///    has, and the new one begins.
    ///
    /// A row whose numbers the buffer cannot store does not fail the call: the environment's
    /// episode is discarded, and its steps are skipped until the next start. Other environments are
    /// not affected. In the steady state, nothing is allocated.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`], [`AddError::RepeatedEnv`], [`AddError::WrongLength`] or an error
    /// of the fields; then nothing has changed.
    ///
    /// # Example
    /// Two environments, of which the first one ends its episode and starts another within the same
    /// step.
    /// ```
    /// use her_relabel::{BufferConfig, Dims, HerBuffer, StepRows};
    ///
    /// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
    /// let mut buffer = HerBuffer::<f32>::new(config.with_num_envs(2))?;
    /// let reset: StepRows<'_, f64> = StepRows {
    ///     env_index: &[0, 1],
    ///     stepped: &[false, false],
    ///     started: &[true, true],
    ///     truncated: &[false, false],
    ///     observation: &[0.0, 0.0],
    ///     achieved_goal: &[0.0, 0.0],
    ///     desired_goal: &[5.0, 6.0],
    ///     ..StepRows::default()
    /// };
    /// buffer.record(&reset)?;
    /// // Actions may be of another type than observations and goals.
    /// let step: StepRows<'_, f64, f64, f32> = StepRows {
    ///     env_index: &[0, 1],
    ///     stepped: &[true, true],
    ///     started: &[true, false],
    ///     action: &[1.0, 1.0],
    ///     reward: &[-1.0, -1.0],
    ///     next_observation: &[1.0, 1.0],
    ///     next_achieved_goal: &[1.0, 1.0],
    ///     terminated: &[false, false],
    ///     truncated: &[true, false],
    ///     observation: &[0.0, 0.0],
    ///     achieved_goal: &[0.0, 0.0],
    ///     desired_goal: &[7.0, 6.0],
    ///     fields: &[],
    /// };
    /// let recorded = buffer.record(&step)?;
    /// assert_eq!((recorded.recorded_steps, recorded.finished_episodes), (2, 1));
    /// assert_eq!(buffer.len(), 1);
    /// assert_eq!(buffer.unfinished_steps(0)?, Some(0));
    /// assert_eq!(buffer.unfinished_steps(1)?, Some(1));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn record<O: Scalar, G: Scalar, A: Scalar>(
        &mut self,
        rows: &StepRows<'_, O, G, A>,
    ) -> Result<Recorded, AddError> {
        rows.check_lens(self.config.dims())?;
        if rows.stepped.contains(&true) {
            check_fields(&self.storage.fields, rows.fields, rows.env_index.len())?;
        }
        self.check_envs(rows.env_index)?;
        let mut recorded = Recorded::default();
        for (at, &env_index) in rows.env_index.iter().enumerate() {
            if let Err(error) = self.record_row(rows, at, env_index, &mut recorded) {
                recorded.first_refusal.get_or_insert(RefusedRow { env_index, error });
            }
        }
        Ok(recorded)
    }

    /// Checks that all environments exist, and that none occurs twice.
    fn check_envs(&mut self, rows: &[usize]) -> Result<(), AddError> {
        self.has_row.fill(false);
        for &env_index in rows {
            let num_envs = self.config.num_envs();
            let has_row = self
                .has_row
                .get_mut(env_index)
                .ok_or(AddError::UnknownEnv { env_index, num_envs })?;
            if std::mem::replace(has_row, true) {
                return Err(AddError::RepeatedEnv { env_index });
            }
        }
        Ok(())
    }

    /// Records the row at `at`, of environment `env_index`. An error is the first refusal of its
    /// numbers.
    fn record_row<O: Scalar, G: Scalar, A: Scalar>(
        &mut self,
        rows: &StepRows<'_, O, G, A>,
        at: usize,
        env_index: usize,
        recorded: &mut Recorded,
    ) -> Result<(), AddError> {
        let dims = self.config.dims();
        let mut refusal = Ok(());
        if rows.stepped[at] && self.unfinished[env_index].is_under_way() {
            let step = rows.step(at, dims);
            refusal = step.check_numbers::<T>(&self.storage.fields);
            if refusal.is_ok() {
                recorded.recorded_steps += 1;
                recorded.finished_episodes += usize::from(self.push_step(env_index, &step));
            } else {
                recorded.skipped_steps += 1;
                recorded.discarded_episodes += 1;
                self.unfinished[env_index].discard();
            }
        } else if rows.stepped[at] {
            recorded.skipped_steps += 1;
        } else if rows.truncated[at] && self.unfinished[env_index].is_under_way() {
            recorded.discarded_episodes += 1;
            self.unfinished[env_index].discard();
        }
        if !rows.started[at] {
            return refusal;
        }
        if self.unfinished[env_index].is_under_way() {
            recorded.finished_episodes += usize::from(self.cut_off(env_index));
        }
        let start = rows.start(at, dims);
        refusal.and(start.check_numbers::<T>().map(|()| {
            self.unfinished[env_index].begin(&self.storage.layout, &start);
        }))
    }
}

impl<'a, O: Copy, G: Copy, A> StepRows<'a, O, G, A> {
    fn check_lens(&self, dims: Dims) -> Result<(), AddError> {
        let n = self.env_index.len();
        check_len("stepped", self.stepped.len(), n)?;
        check_len("started", self.started.len(), n)?;
        check_len("truncated", self.truncated.len(), n)?;
        let check = |any_reads: bool, columns: &[(&str, usize, usize)]| {
            columns.iter().try_for_each(|&(name, len, width)| {
                let may_be_empty = !any_reads && len == 0;
                if may_be_empty { Ok(()) } else { check_len(name, len, n.saturating_mul(width)) }
            })
        };
        let steps = [
            ("action", self.action.len(), dims.action),
            ("reward", self.reward.len(), 1),
            ("next_observation", self.next_observation.len(), dims.observation),
            ("next_achieved_goal", self.next_achieved_goal.len(), dims.goal),
            ("terminated", self.terminated.len(), 1),
        ];
        let starts = [
            ("observation", self.observation.len(), dims.observation),
            ("achieved_goal", self.achieved_goal.len(), dims.goal),
            ("desired_goal", self.desired_goal.len(), dims.goal),
        ];
        check(self.stepped.contains(&true), &steps)?;
        check(self.started.contains(&true), &starts)
    }

    fn start(&self, at: usize, dims: Dims) -> StartRow<'a, O, G> {
        StartRow {
            observation: row(self.observation, at, dims.observation),
            achieved_goal: row(self.achieved_goal, at, dims.goal),
            desired_goal: row(self.desired_goal, at, dims.goal),
        }
    }

    fn step(&self, at: usize, dims: Dims) -> StepRow<'a, O, G, A> {
        StepRow {
            action: row(self.action, at, dims.action),
            reward: self.reward[at],
            next_observation: row(self.next_observation, at, dims.observation),
            next_achieved_goal: row(self.next_achieved_goal, at, dims.goal),
            terminated: self.terminated[at],
            truncated: self.truncated[at],
            fields: self.fields,
            at,
        }
    }
}

impl<O, G, A> Clone for StepRows<'_, O, G, A> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<O, G, A> Copy for StepRows<'_, O, G, A> {}

impl<O, G, A> Default for StepRows<'_, O, G, A> {
    fn default() -> Self {
        Self {
            env_index: &[],
            stepped: &[],
            started: &[],
            action: &[],
            reward: &[],
            next_observation: &[],
            next_achieved_goal: &[],
            terminated: &[],
            truncated: &[],
            observation: &[],
            achieved_goal: &[],
            desired_goal: &[],
            fields: &[],
        }
    }
}

fn row<S>(matrix: &[S], at: usize, len: usize) -> &[S] {
    &matrix[at * len..][..len]
}
