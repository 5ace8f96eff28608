//! Adding steps, of one environment or of all at once, and whole episodes.

use crate::add::arguments::{EpisodeData, EpisodeStart, StartBatch, Step, StepBatch};
use crate::add::check::AddError;
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;
use crate::store::episodes::Ending;

impl<T: Scalar> HerBuffer<T> {
    /// Returns the number of steps of environment `env`'s unfinished episode; `None` if none is under way.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`].
    pub fn unfinished_steps(&self, env: usize) -> Result<Option<usize>, AddError> {
        let is_under_way = self.is_under_way(env)?;
        let steps = self.unfinished[env].steps(&self.storage.layout).min(self.config.capacity());
        Ok(is_under_way.then_some(steps))
    }

    /// Begins an episode of environment `env`, after its reset.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`], [`AddError::EpisodeUnderWay`], or another [`AddError`] for an invalid state.
    pub fn begin_episode<S: Scalar>(
        &mut self,
        env: usize,
        start: &EpisodeStart<'_, S>,
    ) -> Result<(), AddError> {
        if self.is_under_way(env)? {
            return Err(AddError::EpisodeUnderWay { env });
        }
        start.check::<T>(self.config.dims())?;
        self.unfinished[env].begin(&self.storage.layout, start);
        Ok(())
    }

    /// Adds a step of environment `env`. A terminated or truncated step ends the episode, whose
    /// transitions can then be sampled.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`], [`AddError::NoEpisode`], or another [`AddError`] for an invalid step.
    pub fn add_step<S: Scalar>(&mut self, env: usize, step: &Step<'_, S>) -> Result<(), AddError> {
        self.check_under_way(env)?;
        step.check(&self.storage)?;
        self.record(env, step, 0);
        Ok(())
    }

    /// Ends the unfinished episode of environment `env` as truncated. An episode without steps is discarded.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`] or [`AddError::NoEpisode`].
    pub fn end_episode(&mut self, env: usize) -> Result<(), AddError> {
        self.check_under_way(env)?;
        if self.unfinished[env].steps(&self.storage.layout) == 0 {
            self.unfinished[env].discard();
        } else {
            self.store(env, Ending { terminated: false, truncated: true });
        }
        Ok(())
    }

    /// Forgets the unfinished episode of environment `env`.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`] or [`AddError::NoEpisode`].
    pub fn discard_episode(&mut self, env: usize) -> Result<(), AddError> {
        self.check_under_way(env)?;
        self.unfinished[env].discard();
        Ok(())
    }

    /// Adds a whole episode, independent of the environments' unfinished ones. If it is longer than the
    /// capacity, only its newest transitions are kept.
    ///
    /// # Errors
    /// [`AddError`] if the episode is invalid.
    pub fn add_episode<S: Scalar>(&mut self, episode: &EpisodeData<'_, S>) -> Result<(), AddError> {
        episode.check(&self.storage)?;
        self.whole.record(&self.storage, episode);
        let EpisodeData { terminated, truncated, .. } = *episode;
        let rows = self.whole.finish(&self.storage);
        self.storage.push_episode(rows, Ending { terminated, truncated });
        Ok(())
    }

    /// Begins an episode of every environment, after all were reset.
    ///
    /// # Errors
    /// [`AddError::EpisodeUnderWay`], or another [`AddError`] for an invalid state; then nothing has begun.
    pub fn begin_episodes<S: Scalar>(
        &mut self,
        starts: &StartBatch<'_, S>,
    ) -> Result<(), AddError> {
        let (num_envs, dims) = (self.config.num_envs(), self.config.dims());
        starts.check_lens(dims, num_envs)?;
        for env in 0..num_envs {
            if self.is_under_way(env)? {
                return Err(AddError::EpisodeUnderWay { env });
            }
            starts.row(env, dims).check::<T>(dims)?;
        }
        for (env, unfinished) in self.unfinished.iter_mut().enumerate() {
            unfinished.begin(&self.storage.layout, &starts.row(env, dims));
        }
        Ok(())
    }

    /// Adds a step of every environment. Where it ends an episode, the transitions of that episode can
    /// then be sampled, and the next one begins.
    ///
    /// # Errors
    /// [`AddError::NoEpisode`], or another [`AddError`] for an invalid row; then nothing has been added.
    pub fn add_steps<S: Scalar>(&mut self, steps: &StepBatch<'_, S>) -> Result<(), AddError> {
        let (num_envs, dims) = (self.config.num_envs(), self.config.dims());
        steps.check(&self.storage, num_envs)?;
        (0..num_envs).try_for_each(|env| self.check_under_way(env))?;
        for env in 0..num_envs {
            self.record(env, &steps.row(env, dims), env);
            if let Some(starts) = steps.next_starts.filter(|_| steps.ends(env)) {
                self.unfinished[env].begin(&self.storage.layout, &starts.row(env, dims));
            }
        }
        Ok(())
    }

    fn is_under_way(&self, env: usize) -> Result<bool, AddError> {
        let num_envs = self.config.num_envs();
        let unfinished = self.unfinished.get(env).ok_or(AddError::UnknownEnv { env, num_envs })?;
        Ok(unfinished.is_under_way())
    }

    fn check_under_way(&self, env: usize) -> Result<(), AddError> {
        if self.is_under_way(env)? { Ok(()) } else { Err(AddError::NoEpisode { env }) }
    }

    /// Adds a checked step to the unfinished episode, with row `at` of the given fields.
    fn record<S: Scalar>(&mut self, env: usize, step: &Step<'_, S>, at: usize) {
        self.unfinished[env].step(&self.storage, step, at);
        let Step { terminated, truncated, .. } = *step;
        if terminated || truncated {
            self.store(env, Ending { terminated, truncated });
        }
    }

    /// Stores the episode of environment `env`, which has at least one step.
    fn store(&mut self, env: usize, ending: Ending) {
        let unfinished = &mut self.unfinished[env];
        let rows = unfinished.finish(&self.storage);
        self.storage.push_episode(rows, ending);
        unfinished.discard();
    }
}
