//! Recording on from the states in which vectorized environments are.

use crate::add::arguments::{AsStepRows, StartData};
use crate::add::check::AddError;
use crate::add::record::{Recorded, RefusedRow};
use crate::add::unfinished::are_same;
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;
use crate::store::layout::Layout;
use crate::store::storage::Unfinished;

impl<T: Scalar> HerBuffer<T> {
    /// Goes on recording from the states that the rows show, in the middle of episodes as well: in
    /// environments that were restored, in a buffer that was loaded, or after rows that were not
    /// recorded. Only the columns from `observation` to `desired_goal` and the
    /// [numbers](crate::StepRows::numbers) are read, in every row. [`record`](Self::record) then takes
    /// the rows of the next steps.
    ///
    /// Where the episode under way in the buffer is in the state of the row, to the last bit of the
    /// buffer's element type, and has its goal, the episode goes on. Any other ends as truncated
    /// with the steps it has, and one begins in the state of the row. The steps of an episode that
    /// was discarded are still skipped.
    ///
    /// Numbers that cannot be stored are reported as by [`record`](Self::record).
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`], [`AddError::RepeatedEnv`] or [`AddError::WrongLength`]. Then
    /// nothing has changed.
    ///
    /// ```
    /// use her_relabel::{BufferConfig, Dims, HerBuffer, StepRows};
    ///
    /// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
    /// let mut buffer = HerBuffer::<f32>::new(config)?;
    /// let state: StepRows<'_, f64> = StepRows {
    ///     env_index: &[0],
    ///     observation: &[3.0],
    ///     achieved_goal: &[3.0],
    ///     desired_goal: &[5.0],
    ///     ..StepRows::default()
    /// };
    /// buffer.resume(&state)?.check()?;
    /// assert_eq!(buffer.unfinished_steps(0)?, Some(0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn resume(&mut self, rows: &(impl AsStepRows + ?Sized)) -> Result<Recorded, AddError> {
        let rows = &rows.as_step_rows();
        let dims = self.config.dims();
        rows.check_state_lens(dims)?;
        self.check_envs(rows.env_index)?;
        let mut recorded = Recorded::default();
        for (at, &env_index) in rows.env_index.iter().enumerate() {
            let state = rows.start(at, dims);
            let episode = &mut self.unfinished[env_index];
            episode.newest = rows.numbers.map(|numbers| numbers.row(at));
            let goes_on = if episode.is_under_way() {
                episode.is_in(&self.storage.layout, &state)
            } else {
                episode.is_discarded
            };
            if !goes_on && let Err(error) = self.start_row(env_index, &state, &mut recorded) {
                recorded.first_refusal.get_or_insert(RefusedRow { env_index, error });
            }
        }
        Ok(recorded)
    }
}

impl<T: Scalar> Unfinished<T> {
    /// Returns whether the episode under way is in this state and has its goal.
    fn is_in<O: Scalar, G: Scalar>(&self, layout: &Layout, state: &StartData<'_, O, G>) -> bool {
        let last = &self.rows[self.rows.len() - layout.row()..];
        are_same(&last[layout.observation()], state.observation)
            && are_same(&last[layout.achieved_goal()], state.achieved_goal)
            && are_same(&self.desired_goal, state.desired_goal)
    }
}
