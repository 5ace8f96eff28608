//! Adding steps of one environment, and whole episodes.

use crate::add::arguments::{EpisodeData, StartData, StepData};
use crate::add::check::{AddError, check, check_fields};
use crate::add::unfinished::{are_same, fill};
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;
use crate::store::episodes::Ending;

impl<T: Scalar> HerBuffer<T> {
    /// Returns the number of steps of the environment's unfinished episode; `None` if none is under
    /// way.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`].
    pub fn unfinished_steps(&self, env_index: usize) -> Result<Option<usize>, AddError> {
        let is_under_way = self.is_under_way(env_index)?;
        let steps = self.unfinished[env_index].steps(&self.storage.layout);
        Ok(is_under_way.then_some(steps.min(self.config.capacity())))
    }

    /// Begins an episode of an environment, after its reset.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`], [`AddError::EpisodeUnderWay`], or another [`AddError`] for an
    /// invalid state.
    pub fn begin_episode<O: Scalar, G: Scalar>(
        &mut self,
        env_index: usize,
        start: &StartData<'_, O, G>,
    ) -> Result<(), AddError> {
        if self.is_under_way(env_index)? {
            return Err(AddError::EpisodeUnderWay { env_index });
        }
        start.check_lens(self.config.dims())?;
        start.check_numbers::<T>()?;
        self.unfinished[env_index].begin(&self.storage.layout, start);
        self.unfinished[env_index].newest = None;
        Ok(())
    }

    /// Adds a step of an environment. A terminated or truncated step ends the episode, whose
    /// transitions can then be sampled.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`], [`AddError::NoEpisode`], or another [`AddError`] for an invalid
    /// step.
    pub fn add_step<O: Scalar, G: Scalar, A: Scalar>(
        &mut self,
        env_index: usize,
        step: &StepData<'_, O, G, A>,
    ) -> Result<(), AddError> {
        self.check_under_way(env_index)?;
        step.check_lens(self.config.dims())?;
        check_fields(&self.storage.fields, step.fields, 1)?;
        step.check_numbers::<T>(&self.storage.fields, 0)?;
        self.push_step(env_index, step, 0);
        self.unfinished[env_index].newest = None;
        Ok(())
    }

    /// Sets the goal that an environment has from its next step on. Stored episodes have one goal
    /// each: with a new goal, the unfinished episode ends as truncated with the steps it has, and
    /// another begins in its last state. Later, goals to relabel with come from the same episode.
    /// Returns whether an episode with steps has ended.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`], [`AddError::NoEpisode`], or another [`AddError`] for an invalid
    /// goal.
    ///
    /// ```
    /// use her_relabel::{BufferConfig, Dims, HerBuffer, StartData, StepData};
    ///
    /// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
    /// let mut buffer = HerBuffer::<f32>::new(config)?;
    /// let (observation, achieved_goal) = (&[0.0], &[0.0]);
    /// buffer.begin_episode(0, &StartData { observation, achieved_goal, desired_goal: &[5.0] })?;
    /// let step = StepData {
    ///     action: &[1.0],
    ///     reward: -1.0,
    ///     next_observation: &[1.0],
    ///     next_achieved_goal: &[1.0],
    ///     terminated: false,
    ///     truncated: false,
    ///     fields: &[],
    /// };
    /// buffer.add_step(0, &step)?;
    /// assert!(buffer.set_desired_goal(0, &[6.0])?);
    /// assert_eq!((buffer.len(), buffer.unfinished_steps(0)?), (1, Some(0)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn set_desired_goal<G: Scalar>(
        &mut self,
        env_index: usize,
        desired_goal: &[G],
    ) -> Result<bool, AddError> {
        self.check_under_way(env_index)?;
        let layout = &self.storage.layout;
        let unfinished = &mut self.unfinished[env_index];
        let len = unfinished.desired_goal.len();
        if desired_goal.len() == len && are_same(&unfinished.desired_goal, desired_goal) {
            return Ok(false);
        }
        check::<T, G>("desired_goal", desired_goal, len)?;
        let has_steps = unfinished.steps(layout) > 0;
        if has_steps {
            let rows = unfinished.finish(&self.storage);
            self.storage.push_episode(rows, Ending { terminated: false, truncated: true });
            unfinished.keep_last_state(&self.storage.layout);
        }
        fill(&mut unfinished.desired_goal, desired_goal);
        Ok(has_steps)
    }

    /// Ends the unfinished episode of an environment as truncated. An episode without steps is
    /// discarded.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`] or [`AddError::NoEpisode`].
    pub fn end_episode(&mut self, env_index: usize) -> Result<(), AddError> {
        self.check_under_way(env_index)?;
        self.cut_off(env_index);
        Ok(())
    }

    /// Forgets the unfinished episode of an environment. [`record`](Self::record) skips the rest of
    /// its steps.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`] or [`AddError::NoEpisode`].
    pub fn discard_episode(&mut self, env_index: usize) -> Result<(), AddError> {
        self.check_under_way(env_index)?;
        self.unfinished[env_index].discard();
        Ok(())
    }

    /// Adds a whole episode, independent of the environments' unfinished ones. If it is longer than
    /// the capacity, only its newest transitions are kept.
    ///
    /// # Errors
    /// [`AddError`] if the episode is invalid.
    pub fn add_episode<O: Scalar, G: Scalar, A: Scalar>(
        &mut self,
        episode: &EpisodeData<'_, O, G, A>,
    ) -> Result<(), AddError> {
        episode.check(&self.storage)?;
        self.whole.record(&self.storage, episode);
        let EpisodeData { terminated, truncated, .. } = *episode;
        let rows = self.whole.finish(&self.storage);
        self.storage.push_episode(rows, Ending { terminated, truncated });
        Ok(())
    }

    fn is_under_way(&self, env_index: usize) -> Result<bool, AddError> {
        let num_envs = self.config.num_envs();
        let unfinished =
            self.unfinished.get(env_index).ok_or(AddError::UnknownEnv { env_index, num_envs })?;
        Ok(unfinished.is_under_way())
    }

    fn check_under_way(&self, env_index: usize) -> Result<(), AddError> {
        if self.is_under_way(env_index)? { Ok(()) } else { Err(AddError::NoEpisode { env_index }) }
    }

    /// Adds a checked step, whose fields are in their row `at`, to the unfinished episode. Returns
    /// whether the step ends it.
    pub(crate) fn push_step<O: Scalar, G: Scalar, A: Scalar>(
        &mut self,
        env_index: usize,
        step: &StepData<'_, O, G, A>,
        at: usize,
    ) -> bool {
        self.unfinished[env_index].step(&self.storage, step, at);
        let StepData { terminated, truncated, .. } = *step;
        let ends = terminated || truncated;
        if ends {
            self.store(env_index, Ending { terminated, truncated });
        }
        ends
    }

    /// Ends the unfinished episode as truncated, or forgets it if it has no steps. Returns whether
    /// it had any.
    pub(crate) fn cut_off(&mut self, env_index: usize) -> bool {
        let has_steps = self.unfinished[env_index].steps(&self.storage.layout) > 0;
        if has_steps {
            self.store(env_index, Ending { terminated: false, truncated: true });
        } else {
            self.unfinished[env_index].end();
        }
        has_steps
    }

    /// Stores the episode of an environment, which has at least one step.
    fn store(&mut self, env_index: usize, ending: Ending) {
        let unfinished = &mut self.unfinished[env_index];
        let rows = unfinished.finish(&self.storage);
        self.storage.push_episode(rows, ending);
        unfinished.end();
    }
}
