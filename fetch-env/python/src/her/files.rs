//! Files, bytes, and the episodes of other buffers and of data sets.

use std::path::PathBuf;

use baselines::datasets::import_minari;
use her_relabel::{BufferConfig, GoalColumns, HerBuffer};
use pyo3::{prelude::*, types::PyBytes};
use serde_json::{Map, Value};

use super::own_reward::OwnReward;
use super::{Buffer, check_capacity};
use crate::error::{Error, Result};

#[pymethods]
impl Buffer {
    /// Writes all episodes to a file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> Result<()> {
        let contents = self.contents.lock(py)?;
        let buffer = &contents.buffer;
        py.detach(|| buffer.save(&path)).map_err(|error| Error::chain(error).at(&path))
    }

    /// Reads a file that `save` wrote, and returns whether it says what it holds.
    fn load(&self, py: Python<'_>, path: PathBuf) -> Result<bool> {
        let read = py.detach(|| HerBuffer::load(&path));
        self.take(py, read.map_err(|error| Error::chain(error).at(&path))?)
    }

    /// All episodes, as bytes.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        let mut bytes = Vec::new();
        let contents = self.contents.lock(py)?;
        let buffer = &contents.buffer;
        py.detach(|| buffer.write_to(&mut bytes)).map_err(PyErr::from)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Reads bytes that `to_bytes` returned, and returns whether they say what they hold.
    fn set_bytes(&self, py: Python<'_>, bytes: &[u8]) -> Result<bool> {
        let read = py.detach(|| HerBuffer::read_from(bytes)).map_err(Error::value)?;
        self.take(py, read)
    }

    /// Adds copies of all finished episodes of another buffer.
    fn append(&self, py: Python<'_>, other: &Self) -> Result<()> {
        if std::ptr::eq(self, other) {
            return Err(Error::value("other is this buffer itself: pass another one"));
        }
        // Two buffers that take each other's episodes would wait for ever in any other order.
        let is_first = std::ptr::from_ref(other) < std::ptr::from_ref(self);
        let first = if is_first { Some(other.contents.lock(py)?) } else { None };
        let mut ours = self.contents.lock(py)?;
        let theirs = match first {
            Some(theirs) => theirs,
            None => other.contents.lock(py)?,
        };
        let (ours, theirs) = (&mut ours.buffer, &theirs.buffer);
        Ok(py.detach(|| ours.append(theirs))?)
    }

    /// Writes all finished episodes as an archive of numpy arrays.
    fn export_npz(&self, py: Python<'_>, path: PathBuf) -> Result<()> {
        let contents = self.contents.lock(py)?;
        let buffer = &contents.buffer;
        py.detach(|| buffer.export_npz(&path)).map_err(|error| Error::chain(error).at(&path))
    }

    /// Adds the episodes of such an archive, and returns their number.
    fn import_npz(&self, py: Python<'_>, path: PathBuf) -> Result<u64> {
        let buffer = &mut self.contents.lock(py)?.buffer;
        py.detach(|| buffer.import_npz(&path)).map_err(|error| Error::chain(error).at(&path))
    }

    /// Adds the episodes of a data set in Minari's form, and returns their number.
    fn import_minari(&self, py: Python<'_>, folder: PathBuf) -> Result<u64> {
        let buffer = &mut self.contents.lock(py)?.buffer;
        let added = py.detach(|| import_minari(buffer, &folder));
        added.map_err(|error| Error::chain(error).at(&folder))
    }

    /// Adds the trajectories of a data set of OGBench, and returns their number. Their rewards are
    /// those of the settings, or of a function.
    #[pyo3(signature = (path, reward = None))]
    fn import_ogbench(
        &self,
        py: Python<'_>,
        path: PathBuf,
        reward: Option<Py<PyAny>>,
    ) -> Result<u64> {
        let goals = GoalColumns {
            array: "achieved_goals",
            width: self.dims.goal,
            columns: 0..self.dims.goal,
            desired: Some("desired_goals"),
        };
        let buffer = &mut self.contents.lock(py)?.buffer;
        let own = OwnReward::new(reward.as_ref(), None, &self.reward);
        let added = py.detach(|| match reward {
            None => buffer.import_ogbench(&path, &goals, &self.reward),
            Some(_) => buffer.import_ogbench(&path, &goals, &own),
        });
        own.into_error().map_or(Ok(()), Err)?;
        self.reward.check()?;
        added.map_err(|error| Error::chain(error).at(&path))
    }
}

impl Buffer {
    /// Takes the contents of a buffer that was read, and returns whether it says what they are.
    fn take(&self, py: Python<'_>, read: HerBuffer<f32>) -> Result<bool> {
        let (theirs, ours) = (read.config(), &self.task);
        let is_described = !theirs.task().is_empty();
        if is_described && theirs.task() != ours {
            return Err(Error::value(format!(
                "the file holds transitions of another kind ({}) than the buffer ({ours}): load it \
                 into a buffer that was made for them",
                theirs.task(),
            )));
        }
        if theirs.dims() != self.dims {
            let (theirs, ours) = (theirs.dims(), self.dims);
            return Err(Error::value(format!("the file has {theirs:?}, the buffer has {ours:?}")));
        }
        check_capacity(theirs.capacity(), self.episode_len)?;
        let mut contents = self.contents.lock(py)?;
        let ours = chosen(contents.buffer.config())?;
        for (name, theirs) in chosen(theirs)? {
            if theirs != ours[&name] {
                let shown = |value: &Value| match value {
                    Value::Null => "None".to_owned(),
                    value => value.to_string(),
                };
                return Err(Error::value(format!(
                    "the file has {name}={}, the buffer has {}: load it into a buffer made with \
                     the same",
                    shown(&theirs),
                    shown(&ours[&name])
                )));
            }
        }
        contents.buffer = read;
        Ok(is_described)
    }
}

/// Returns the settings that a buffer's maker chooses besides its size, by their names.
fn chosen(config: &BufferConfig) -> Result<Map<String, Value>> {
    let fields = config.fields().iter().map(|field| (field.name.clone(), field.len.into()));
    let fields = Value::Object(fields.collect());
    let priorities = serde_json::to_value(config.priorities()).map_err(Error::value)?;
    let motionless = serde_json::to_value(config.motionless_episodes()).map_err(Error::value)?;
    let settings =
        [("fields", fields), ("priorities", priorities), ("motionless_episodes", motionless)];
    Ok(settings.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
}
