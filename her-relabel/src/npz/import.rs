//! Importing episodes from numpy.

use std::path::Path;

use goal_reward::Dims;
use rawzip::ZipArchive;

use crate::add::arguments::{EpisodeData, FieldRows};
use crate::npz::array::{
    ACHIEVED_GOALS, ACTIONS, Array, COUNTS, DESIRED_GOALS, EPISODE_LENGTHS, FLAGS, FLOATS,
    NpzError, OBSERVATIONS, REWARDS, TERMINATED, TRUNCATED, field_array,
};
use crate::npz::{contents, io_error};
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;

impl<T: Scalar> HerBuffer<T> {
    /// Adds all episodes of an archive of numpy arrays, in their order, and returns their number.
    /// The archive has the form that [`export_npz`](Self::export_npz) writes, compressed or not,
    /// and contains all fields of this buffer. Other arrays are ignored. Episodes that the buffer
    /// leaves out as [motionless](crate::MotionlessEpisodes) are counted too.
    ///
    /// An import takes no more memory than the file and this buffer's capacity, whatever sizes the
    /// archive claims. The file is a regular one of at most 64 GiB.
    ///
    /// # Errors
    /// [`NpzError`]; then no episode has been added.
    pub fn import_npz(&mut self, path: impl AsRef<Path>) -> Result<u64, NpzError> {
        self.import_npz_bytes(&contents(path.as_ref())?)
    }

    /// Adds all episodes of an archive in memory, as [`import_npz`](Self::import_npz) does.
    ///
    /// # Errors
    /// [`NpzError`]; then no episode has been added.
    pub fn import_npz_bytes(&mut self, bytes: &[u8]) -> Result<u64, NpzError> {
        self.import_staged(|staged| read(staged, bytes))
    }

    /// Adds the episodes that `read` adds to another buffer, or none if it fails.
    pub(super) fn import_staged(
        &mut self,
        read: impl FnOnce(&mut Self) -> Result<u64, NpzError>,
    ) -> Result<u64, NpzError> {
        let config = self.config.clone().with_num_envs(1).with_priorities(None);
        // It cannot fail, because this buffer has the same sizes.
        let Ok(mut staged) = Self::new(config) else { return Ok(0) };
        // It leaves out the motionless episodes that this buffer would leave out.
        staged.storage.ended = self.storage.ended;
        let count = read(&mut staged)?;
        let mut rows = Vec::new();
        for episode in staged.storage.episodes.iter() {
            staged.storage.copy_episode(&episode, self.config.capacity(), &mut rows);
            self.storage.store_episode(&rows, episode.ending);
        }
        self.storage.ended = staged.storage.ended;
        Ok(count)
    }
}

/// Adds the episodes of an archive, whose arrays are read side by side.
fn read<T: Scalar>(buffer: &mut HerBuffer<T>, bytes: &[u8]) -> Result<u64, NpzError> {
    let archive = &ZipArchive::from_slice(bytes).map_err(io_error)?;
    let config = buffer.config().clone();
    let Dims { observation, goal, action } = config.dims();
    let mut lengths = Array::open(archive, EPISODE_LENGTHS, &COUNTS, 1, None)?;
    let mut rewards = Array::open(archive, REWARDS, &FLOATS, 1, None)?;
    let (num_episodes, num_steps) = (lengths.len(), rewards.len());
    let (episodes, steps) = (Some(num_episodes), Some(num_steps));
    let num_states = Some(num_episodes.saturating_add(num_steps));
    let mut terminated = Array::open(archive, TERMINATED, &FLAGS, 1, episodes)?;
    let mut truncated = Array::open(archive, TRUNCATED, &FLAGS, 1, episodes)?;
    let mut observations = Array::open(archive, OBSERVATIONS, &FLOATS, observation, num_states)?;
    let mut achieved_goals = Array::open(archive, ACHIEVED_GOALS, &FLOATS, goal, num_states)?;
    let mut desired_goals = Array::open(archive, DESIRED_GOALS, &FLOATS, goal, episodes)?;
    let mut actions = Array::open(archive, ACTIONS, &FLOATS, action, steps)?;
    let mut fields = Vec::new();
    for field in config.fields() {
        fields.push(Array::open(archive, &field_array(field), &FLOATS, field.len, steps)?);
    }

    let capacity = config.capacity() as u64;
    let mut found = 0;
    let mut parts: [Vec<f64>; 5] = Default::default();
    let mut field_parts = vec![Vec::new(); fields.len()];
    for episode in 0..num_episodes {
        let len = lengths.next()?;
        found = u64::saturating_add(found, len);
        if len == 0 || found > num_steps {
            return Err(NpzError::Lengths { episode, found, expected: num_steps });
        }
        let [states, achieved, desired, acts, rews] = &mut parts;
        let num_rows = len.saturating_add(1);
        observations.take(num_rows, capacity + 1, states)?;
        achieved_goals.take(num_rows, capacity + 1, achieved)?;
        desired_goals.take(1, 1, desired)?;
        actions.take(len, capacity, acts)?;
        rewards.take(len, capacity, rews)?;
        for (field, part) in fields.iter_mut().zip(&mut field_parts) {
            field.take(len, capacity, part)?;
        }
        let named = config.fields().iter().zip(&field_parts);
        let rows: Vec<FieldRows<'_, f64>> =
            named.map(|(field, part)| (&field.name[..], &part[..])).collect();
        let data = EpisodeData {
            observation: states,
            achieved_goal: achieved,
            desired_goal: desired,
            action: acts,
            reward: rews,
            terminated: terminated.next()?,
            truncated: truncated.next()?,
            fields: &rows,
        };
        buffer.add_episode(&data).map_err(|source| NpzError::Episode { episode, source })?;
    }
    if found < num_steps {
        let episode = num_episodes.saturating_sub(1);
        return Err(NpzError::Lengths { episode, found, expected: num_steps });
    }
    lengths.finish()?;
    [terminated, truncated].into_iter().try_for_each(Array::finish)?;
    let matrices = [observations, achieved_goals, desired_goals, actions, rewards];
    matrices.into_iter().chain(fields).try_for_each(Array::finish)?;
    Ok(num_episodes)
}
