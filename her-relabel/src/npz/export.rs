//! Exporting episodes to numpy.

use std::io::{self, BufWriter, IntoInnerError, Write};
use std::ops::Range;
use std::path::Path;

use goal_reward::Dims;
use rawzip::time::UtcDateTime;
use rawzip::{ZipArchiveWriter, ZipDataWriter, ZipEntryWriter};

use crate::files::replace;
use crate::npz::array::{
    ACHIEVED_GOALS, ACTIONS, DESIRED_GOALS, EPISODE_LENGTHS, OBSERVATIONS, REWARDS, TERMINATED,
    TRUNCATED, field_array,
};
use crate::npz::header::Header;
use crate::npz::io_error;
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;
use crate::store::episodes::Episode;
use crate::store::storage::Storage;

impl<T: Scalar> HerBuffer<T> {
    /// Writes all finished episodes, or what is left of them, as an archive of numpy arrays. As
    /// with [`save`](Self::save), the file appears whole or not at all, and no other file is
    /// changed.
    ///
    /// The arrays for `E` episodes of `N` transitions in total, with each state stored once:
    ///
    /// | array | shape | type |
    /// |---|---|---|
    /// | `episode_lengths` | `(E,)` | `i8` |
    /// | `observations`, `achieved_goals` | `(N + E, dim)` | `f4` or `f8`, as in the buffer |
    /// | `desired_goals` | `(E, dim)` | the same |
    /// | `actions` | `(N, dim)` | the same |
    /// | `rewards` | `(N,)` | the same |
    /// | `terminated`, `truncated` | `(E,)` | `bool` |
    /// | `fields_NAME`, for each field | `(N, len)` | the same |
    ///
    /// In Python, episode `i` is:
    /// ```python
    /// data = numpy.load("episodes.npz")
    /// ends = numpy.cumsum(data["episode_lengths"])
    /// start, end = ends[i] - data["episode_lengths"][i], ends[i]
    /// observations = data["observations"][start + i : end + i + 1]  # one more state than steps
    /// actions = data["actions"][start:end]
    /// ```
    ///
    /// # Errors
    /// Errors of the file system.
    pub fn export_npz(&self, path: impl AsRef<Path>) -> io::Result<()> {
        replace(path.as_ref(), |file| self.write_npz(file))
    }

    /// Writes the archive of [`export_npz`](Self::export_npz) to a writer.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn write_npz(&self, writer: impl Write) -> io::Result<()> {
        let Storage { layout, fields, .. } = &self.storage;
        let (num_episodes, num_steps) = (self.num_episodes() as u64, self.len() as u64);
        let mut archive = Archive { zip: ZipArchiveWriter::new(writer), buffer: self };
        archive.array(EPISODE_LENGTHS, "<i8", &[num_episodes], |out, episode| {
            out.write_all(&(episode.end - episode.start).to_le_bytes())
        })?;
        archive.array(TERMINATED, "|b1", &[num_episodes], |out, episode| {
            out.write_all(&[episode.ending.terminated.into()])
        })?;
        archive.array(TRUNCATED, "|b1", &[num_episodes], |out, episode| {
            out.write_all(&[episode.ending.truncated.into()])
        })?;
        let states = |episode: &Episode| episode.row(episode.start)..episode.last_row() + 1;
        let steps = |episode: &Episode| episode.row(episode.start)..episode.last_row();
        let last = |episode: &Episode| episode.last_row()..episode.last_row() + 1;
        let Dims { observation, goal, action } = layout.dims();
        let shape = |rows: u64, width: usize| [rows, width as u64];
        let num_states = num_steps + num_episodes;
        let observations = shape(num_states, observation);
        archive.rows(OBSERVATIONS, &observations, states, layout.observation())?;
        let achieved_goals = shape(num_states, goal);
        archive.rows(ACHIEVED_GOALS, &achieved_goals, states, layout.achieved_goal())?;
        archive.rows(DESIRED_GOALS, &shape(num_episodes, goal), last, layout.desired_goal())?;
        archive.rows(ACTIONS, &shape(num_steps, action), steps, layout.action())?;
        archive.rows(REWARDS, &[num_steps], steps, layout.reward()..layout.reward() + 1)?;
        for (field, place) in fields.places() {
            let start = layout.fields().start;
            let place = start + place.start..start + place.end;
            archive.rows(&field_array(field), &shape(num_steps, field.len), steps, place)?;
        }
        archive.zip.finish().map_err(io_error)?.flush()
    }
}

/// The time of all arrays, in seconds since 1970: the earliest that an archive can express, so that
/// archives of the same episodes are identical.
const TIME: i64 = 315_532_800;

/// The writer of an archive.
struct Archive<'a, T, W> {
    zip: ZipArchiveWriter<W>,
    buffer: &'a HerBuffer<T>,
}

type Out<'a, 'b, W> = BufWriter<ZipDataWriter<&'a mut ZipEntryWriter<'b, W>>>;

impl<T: Scalar, W: Write> Archive<'_, T, W> {
    /// Writes an array of the elements at `place` in the rows that `rows` lists for each episode.
    fn rows(
        &mut self,
        name: &str,
        shape: &[u64],
        rows: impl Fn(&Episode) -> Range<u64>,
        place: Range<usize>,
    ) -> io::Result<()> {
        let dtype = if size_of::<T>() == size_of::<f32>() { "<f4" } else { "<f8" };
        let tape = &self.buffer.storage.tape;
        self.array(name, dtype, shape, |out, episode| {
            let elements = rows(episode).flat_map(|row| &tape.row(row)[place.clone()]);
            elements.copied().try_for_each(|element| {
                out.write_all(&element.bits().to_le_bytes()[..size_of::<T>()])
            })
        })
    }

    /// Writes an array. `write` writes the part of one episode.
    fn array(
        &mut self,
        name: &str,
        dtype: &str,
        shape: &[u64],
        mut write: impl FnMut(&mut Out<'_, '_, W>, &Episode) -> io::Result<()>,
    ) -> io::Result<()> {
        // Not compressed, as by numpy.savez: compression hardly shrinks sensor values.
        let file = self.zip.new_file(format!("{name}.npy"));
        let file = file.last_modified(UtcDateTime::from_unix(TIME));
        let (mut file, data) = file.start().map_err(io_error)?;
        let header =
            Header { descr: dtype.to_owned(), fortran_order: false, shape: shape.to_vec() };
        let mut out = BufWriter::new(data.wrap(&mut file));
        out.write_all(&header.to_bytes()?)?;
        for episode in self.buffer.storage.episodes.iter() {
            write(&mut out, &episode)?;
        }
        let data = out.into_inner().map_err(IntoInnerError::into_error)?;
        let (_, descriptor) = data.finish().map_err(io_error)?;
        file.finish(descriptor).map_err(io_error)?;
        Ok(())
    }
}
