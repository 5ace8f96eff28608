//! Adding a step of every environment at once.

use crate::add::arguments::{StartBatch, StepBatch};
use crate::add::check::AddError;
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;

impl<T: Scalar> HerBuffer<T> {
    /// Begins an episode of every environment, after all were reset.
    ///
    /// # Errors
    /// [`AddError::EpisodeUnderWay`], or an error in a state; then nothing has begun.
    pub fn begin_episodes<S: Scalar>(
        &mut self,
        starts: &StartBatch<'_, S>,
    ) -> Result<(), AddError> {
        let (num_envs, dims) = (self.config.num_envs(), self.config.dims());
        starts.check_lens(dims, num_envs)?;
        for env in 0..num_envs {
            if self.unfinished[env].is_under_way() {
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
    /// [`AddError::NoEpisode`], or an error in a row; then nothing has been added.
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
}
