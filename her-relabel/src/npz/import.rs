//! Importing episodes from numpy.

use std::fs::File;
use std::io::{self, BufReader, Cursor, Read, Seek};
use std::path::Path;

use zip::ZipArchive;

use crate::add::arguments::{EpisodeData, FieldRows};
use crate::npz::array::Array;
use crate::npz::arrays::{Arrays, EPISODE_LENGTHS, TERMINATED, TRUNCATED};
use crate::npz::error::NpzError;
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;

impl<T: Scalar> HerBuffer<T> {
    /// Adds all episodes of an archive of numpy arrays, in their order, and returns their number. The
    /// archive has the form that [`export_npz`](Self::export_npz) writes, compressed or not, with all fields
    /// of this buffer. Other arrays in it are ignored.
    ///
    /// The arrays are read side by side, so that an import takes no more memory than the file and this
    /// buffer's capacity, whatever sizes the archive claims.
    ///
    /// # Errors
    /// [`NpzError`]; then no episode has been added.
    pub fn import_npz(&mut self, path: impl AsRef<Path>) -> Result<u64, NpzError> {
        let path = path.as_ref();
        self.import(|| File::open(path).map(BufReader::new))
    }

    /// Adds all episodes of an archive in memory, as [`import_npz`](Self::import_npz) does.
    ///
    /// # Errors
    /// [`NpzError`]; then no episode has been added.
    pub fn import_npz_bytes(&mut self, bytes: &[u8]) -> Result<u64, NpzError> {
        self.import(|| Ok(Cursor::new(bytes)))
    }

    fn import<R: Read + Seek>(
        &mut self,
        open: impl Fn() -> io::Result<R>,
    ) -> Result<u64, NpzError> {
        let config = self.config.clone().with_num_envs(1).with_priorities(None);
        // It cannot fail, because this buffer has the same sizes.
        let Ok(mut staged) = Self::new(config) else { return Ok(0) };
        let count = read(&mut staged, open)?;
        let episodes = &staged.storage.episodes;
        let mut rows = Vec::new();
        for number in episodes.numbers() {
            let episode = episodes.get(number);
            rows.clear();
            for row in episode.row(episode.start)..=episode.last_row() {
                rows.extend_from_slice(staged.storage.tape.row(row));
            }
            self.storage.push_episode(&rows, episode.ending);
        }
        Ok(count)
    }
}

/// Adds the episodes of an archive, which is opened once for each array.
fn read<T: Scalar, R: Read + Seek>(
    buffer: &mut HerBuffer<T>,
    open: impl Fn() -> io::Result<R>,
) -> Result<u64, NpzError> {
    let another = || ZipArchive::new(open()?).map_err(|error| NpzError::Archive(error.into()));
    let names = Arrays::new(buffer.config());
    let (mut lengths, mut rewards) = (another()?, another()?);
    let mut lengths = Array::<u64>::open(&mut lengths, EPISODE_LENGTHS, 1)?;
    let mut rewards = Array::<f64>::open(&mut rewards, &names.rewards.0, 1)?;
    let (num_episodes, num_steps) = (lengths.len(), rewards.len());
    let num_states = num_episodes.saturating_add(num_steps);
    let mut archives = (another()?, another()?, another()?, another()?, another()?, another()?);
    let mut terminated = flags(&mut archives.0, TERMINATED, num_episodes)?;
    let mut truncated = flags(&mut archives.1, TRUNCATED, num_episodes)?;
    let mut observations = matrix(&mut archives.2, &names.observations, num_states)?;
    let mut achieved_goals = matrix(&mut archives.3, &names.achieved_goals, num_states)?;
    let mut desired_goals = matrix(&mut archives.4, &names.desired_goals, num_episodes)?;
    let mut actions = matrix(&mut archives.5, &names.actions, num_steps)?;
    let mut field_archives =
        names.fields.iter().map(|_| another()).collect::<Result<Vec<_>, _>>()?;
    let mut fields = field_archives
        .iter_mut()
        .zip(&names.fields)
        .map(|(archive, name)| matrix(archive, name, num_steps))
        .collect::<Result<Vec<_>, _>>()?;

    let field_names: Vec<String> =
        buffer.config().fields().iter().map(|field| field.name.clone()).collect();
    let capacity = buffer.config().capacity() as u64;
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
        observations.take(len + 1, capacity + 1, states)?;
        achieved_goals.take(len + 1, capacity + 1, achieved)?;
        desired_goals.take(1, 1, desired)?;
        actions.take(len, capacity, acts)?;
        rewards.take(len, capacity, rews)?;
        for (field, part) in fields.iter_mut().zip(&mut field_parts) {
            field.take(len, capacity, part)?;
        }
        let rows: Vec<FieldRows<'_, f64>> = field_names
            .iter()
            .zip(&field_parts)
            .map(|(name, part)| (name.as_str(), part.as_slice()))
            .collect();
        let data = EpisodeData {
            observations: states,
            achieved_goals: achieved,
            desired_goal: desired,
            actions: acts,
            rewards: rews,
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

fn flags<'a, R: Read + Seek>(
    archive: &'a mut ZipArchive<R>,
    name: &str,
    rows: u64,
) -> Result<Array<'a, bool>, NpzError> {
    Array::open(archive, name, 1)?.with_rows(rows)
}

fn matrix<'a, R: Read + Seek>(
    archive: &'a mut ZipArchive<R>,
    (name, width): &(String, usize),
    rows: u64,
) -> Result<Array<'a, f64>, NpzError> {
    Array::open(archive, name, *width)?.with_rows(rows)
}
