//! Recording the rows of vectorized environments.

use thiserror::Error;

use crate::add::arguments::{AsStepRows, StartData, StepRows};
use crate::add::check::{AddError, check_fields};
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;

/// The result of [`HerBuffer::record`]. Every row with a step is either recorded or skipped.
///
/// [`check`](Self::check) turns a row that the buffer refused into an error.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
#[must_use = "the buffer may have refused a row: call `check`, or read `first_refusal`"]
pub struct Recorded {
    /// The number of steps added to episodes.
    pub recorded_steps: usize,
    /// The number of steps that were not added, because the buffer cannot store their numbers or
    /// has discarded the beginning of their episode.
    pub skipped_steps: usize,
    /// The number of episodes that ended with at least one step, a new goal included. They can now be
    /// sampled, except [motionless ones](crate::MotionlessEpisodes) that the buffer does not keep.
    pub finished_episodes: usize,
    /// The number of unfinished episodes that were discarded, because their environment failed or
    /// the buffer cannot store one of their steps.
    pub discarded_episodes: usize,
    /// The first row whose numbers the buffer cannot store.
    pub first_refusal: Option<RefusedRow>,
}

impl Recorded {
    /// Returns an error if the buffer refused a row. A failed environment is not a refused row: it
    /// reports its error itself.
    ///
    /// # Errors
    /// [`RefusedRow`].
    pub fn check(self) -> Result<(), RefusedRow> {
        self.first_refusal.map_or(Ok(()), Err)
    }
}

/// A row whose numbers the buffer cannot store.
#[derive(Clone, PartialEq, Error)]
#[error("environment {env_index} has numbers that cannot be stored: {error}")]
#[non_exhaustive]
pub struct RefusedRow {
    /// The environment.
    pub env_index: usize,
    /// The first number that cannot be stored, by its place in the row.
    pub error: AddError,
}
debug_as_display!(RefusedRow);

impl<T: Scalar> HerBuffer<T> {
    /// Records rows of vectorized environments, in any autoreset mode: of all environments, or of
    /// those that an asynchronous vectorization has received. First pass the rows of a reset, in
    /// which episodes start, and then those of every step.
    ///
    /// Each row is recorded in this order:
    /// 1. A step is added to the environment's episode, and ends it if it is terminated or
    ///    truncated. If the desired goal after the step is a new one, it is
    ///    [set](Self::set_desired_goal) before. If the episode was discarded, the step is skipped.
    /// 2. A truncated row without a step means that the environment failed: its unfinished episode
    ///    is discarded. Steps before its next start are skipped.
    /// 3. Where an episode starts, one that is still under way ends as truncated with the steps it
    ///    has, and the new one begins.
    ///
    /// If the buffer cannot store the numbers of a row, that environment's episode is discarded,
    /// and its steps are skipped until the next start; the call succeeds, and other environments
    /// are not affected. In the steady state, nothing is allocated.
    ///
    /// Rows with [numbers](StepRows::numbers) are recorded once, in order: a step is added only to
    /// the episode that the previous row of its environment began or continued. Rows may be left
    /// out before one that starts an episode: the episode before ends with the steps that it has.
    /// To go on in the middle of an episode, [`resume`](Self::resume) with its rows.
    ///
    /// # Errors
    /// [`AddError::NoEpisode`] if a row has a step of an environment that has begun no episode
    /// since the last one ended: the rows of its reset were not recorded. For rows with numbers,
    /// [`AddError::RecordedBefore`], [`AddError::RowsMissing`], and [`AddError::OtherEpisode`] if
    /// the episode under way was begun by hand, loaded, or recorded from another source.
    /// [`AddError::UnknownEnv`], [`AddError::RepeatedEnv`], [`AddError::WrongLength`] or an error
    /// of the fields. Then nothing has changed.
    ///
    /// # Example
    /// The first of two environments ends its episode and starts another in the same step.
    /// ```
    /// use her_relabel::{BufferConfig, Dims, HerBuffer, StepRows};
    ///
    /// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
    /// let mut buffer = HerBuffer::<f32>::new(config.with_num_envs(2))?;
    /// let reset = StepRows {
    ///     env_index: &[0, 1],
    ///     stepped: &[false, false],
    ///     started: &[true, true],
    ///     truncated: &[false, false],
    ///     observation: &[0.0, 0.0],
    ///     achieved_goal: &[0.0, 0.0],
    ///     desired_goal: &[5.0, 6.0],
    ///     ..StepRows::default()
    /// };
    /// buffer.record(&reset)?.check()?;
    /// let step = StepRows {
    ///     stepped: &[true, true],
    ///     started: &[true, false],
    ///     action: &[1.0_f32, 1.0], // of another type than observations and goals
    ///     reward: &[-1.0, -1.0],
    ///     next_observation: &[1.0, 1.0],
    ///     next_achieved_goal: &[1.0, 1.0],
    ///     terminated: &[false, false],
    ///     truncated: &[true, false],
    ///     desired_goal: &[7.0, 6.0],
    ///     ..reset
    /// };
    /// let recorded = buffer.record(&step)?;
    /// assert_eq!((recorded.recorded_steps, recorded.finished_episodes), (2, 1));
    /// assert_eq!(buffer.len(), 1);
    /// assert_eq!(buffer.unfinished_steps(0)?, Some(0));
    /// assert_eq!(buffer.unfinished_steps(1)?, Some(1));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn record(&mut self, rows: &(impl AsStepRows + ?Sized)) -> Result<Recorded, AddError> {
        let rows = &rows.as_step_rows();
        rows.check_lens(self.config.dims())?;
        if rows.stepped.contains(&true) {
            check_fields(&self.storage.fields, rows.fields, rows.env_index.len())?;
        }
        self.check_envs(rows.env_index)?;
        self.check_order(rows)?;
        let mut recorded = Recorded::default();
        for (at, &env_index) in rows.env_index.iter().enumerate() {
            if let Err(error) = self.record_row(rows, at, env_index, &mut recorded) {
                recorded.first_refusal.get_or_insert(RefusedRow { env_index, error });
            }
        }
        Ok(recorded)
    }

    /// Checks that all environments exist, and that none occurs twice.
    pub(crate) fn check_envs(&mut self, rows: &[usize]) -> Result<(), AddError> {
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
        let is_under_way = self.unfinished[env_index].is_under_way();
        if rows.stepped[at] || rows.started[at] || rows.truncated[at] {
            self.unfinished[env_index].newest = rows.numbers.map(|numbers| numbers.row(at));
        }
        if rows.stepped[at] && is_under_way {
            let step = rows.step(at, dims);
            let goal = rows.next_desired_goal(at, dims);
            refusal = step.check_numbers::<T>(&self.storage.fields, at).and_then(|()| {
                let changed =
                    goal.map(|goal| self.set_desired_goal(env_index, goal)).transpose()?;
                recorded.finished_episodes += usize::from(changed == Some(true));
                Ok(())
            });
            if refusal.is_ok() {
                recorded.recorded_steps += 1;
                recorded.finished_episodes += usize::from(self.push_step(env_index, &step, at));
            } else {
                recorded.skipped_steps += 1;
                recorded.discarded_episodes += 1;
                self.unfinished[env_index].discard();
            }
        } else if rows.stepped[at] {
            recorded.skipped_steps += 1;
        } else if rows.truncated[at] {
            recorded.discarded_episodes += usize::from(is_under_way);
            self.unfinished[env_index].discard();
        }
        if rows.started[at] {
            refusal.and(self.start_row(env_index, &rows.start(at, dims), recorded))
        } else {
            refusal
        }
    }

    /// Ends the episode that is under way as truncated, and begins one.
    pub(crate) fn start_row<O: Scalar, G: Scalar>(
        &mut self,
        env_index: usize,
        start: &StartData<'_, O, G>,
        recorded: &mut Recorded,
    ) -> Result<(), AddError> {
        if self.unfinished[env_index].is_under_way() {
            recorded.finished_episodes += usize::from(self.cut_off(env_index));
        }
        let checked = start.check_numbers::<T>();
        let unfinished = &mut self.unfinished[env_index];
        if checked.is_ok() {
            unfinished.begin(&self.storage.layout, start);
        } else {
            unfinished.discard();
        }
        checked
    }
}
