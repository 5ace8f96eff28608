//! Writes data sets in Minari's format.

use std::fs;
use std::path::{Path, PathBuf};

use arrow_ipc::writer::FileWriter;
use serde_json::{Value, json};

use super::environment::{own_spec, robotics_spec};
use super::spaces::space_json;
use super::table::table;
use crate::datasets::episode::EpisodeRecord;
use crate::datasets::error::DatasetError;
use crate::datasets::metadata::Metadata;
use crate::datasets::staged_folder::StagedFolder;
use crate::datasets::writer::DatasetWriter;

/// The version of Minari whose format this is; later versions read it, too.
const VERSION: &str = "0.5.0";

/// Writes a data set that Minari loads, in its Arrow format: a folder for each episode, where each
/// row of a table has a state and the step from it.
///
/// | value in Minari | shape | type |
/// |---|---|---|
/// | `observations["observation"]`, `["achieved_goal"]`, `["desired_goal"]` | `(T + 1, dim)` | `f8` |
/// | `actions` | `(T, dim)` | `f4` |
/// | `rewards`, of the environment | `(T,)` | `f8` |
/// | `terminations`, `truncations` | `(T,)` | `bool` |
/// | `infos["is_success"]` | `(T + 1, 1)` | `f4` |
/// | `infos["distance"]`, in meters; `["sparse_reward"]`, `["dense_reward"]` of each state | `(T + 1, 1)` | `f8` |
/// | `infos["qpos"]`, `["qvel"]` | `(T + 1, dim)` | `f8` |
/// | `infos["snapshot"]`, [if it is asked for](Self::with_snapshots) | `(T + 1, length)` | `u1` |
///
/// The metadata of an episode contain its seed. In a built-in task, `recover_environment()` makes the
/// environment of the Python package `fetch-env`, and `recover_environment(eval_env=True)` that of
/// gymnasium-robotics, which must be installed.
#[derive(Debug)]
pub struct MinariWriter {
    metadata: Metadata,
    folder: StagedFolder,
    /// The folder of the episodes.
    data: PathBuf,
    episodes: usize,
    steps: usize,
    bytes: u64,
    has_snapshots: bool,
}

impl MinariWriter {
    /// Begins a data set in a folder of data sets, which the environment variable
    /// `MINARI_DATASETS_PATH` names for Minari; the data set is below it, at the path that its name
    /// gives.
    ///
    /// # Errors
    /// [`DatasetError::Exists`] if something with that name exists; [`DatasetError::File`] if a
    /// folder cannot be made.
    pub fn create(root: impl AsRef<Path>, metadata: Metadata) -> Result<Self, DatasetError> {
        let folder = StagedFolder::create(root.as_ref(), &metadata.name)?;
        let data = folder.path().join("data");
        fs::create_dir(&data).map_err(DatasetError::file(&data))?;
        Ok(Self { metadata, folder, data, episodes: 0, steps: 0, bytes: 0, has_snapshots: false })
    }

    /// Also writes the exact state of the environment inside its time limit, as the bytes that
    /// `get_state` of the Python package returns, padded with spaces to the longest of the episode:
    /// `env.unwrapped.set_state(bytes(episode.infos["snapshot"][t]))`. Each state takes about 3 kB.
    #[must_use]
    pub const fn with_snapshots(mut self) -> Self {
        self.has_snapshots = true;
        self
    }

    /// Writes the next episode.
    ///
    /// # Errors
    /// As [`DatasetWriter::write`], and [`DatasetError::Arrow`].
    pub fn write(&mut self, episode: &EpisodeRecord) -> Result<(), DatasetError> {
        episode.check(&self.metadata)?;
        let (actual, expected) = (episode.snapshots.len(), episode.rewards.len() + 1);
        if self.has_snapshots && actual != expected {
            return Err(DatasetError::Length { column: "snapshots", actual, expected });
        }
        let table = table(episode, self.has_snapshots)?;
        let mut arrow = Vec::new();
        let mut writer = FileWriter::try_new(&mut arrow, &table.schema())?;
        writer.write(&table)?;
        writer.finish()?;
        drop(writer);
        let steps = episode.rewards.len();
        let metadata = json!({ "id": self.episodes, "total_steps": steps, "seed": episode.seed });
        let folder = self.data.join(self.episodes.to_string());
        fs::create_dir(&folder).map_err(DatasetError::file(&folder))?;
        self.file(&folder.join("part-0.arrow"), &arrow)?;
        self.file(&folder.join("metadata.json"), metadata.to_string().as_bytes())?;
        self.episodes += 1;
        self.steps += steps;
        Ok(())
    }

    /// Finishes the data set and gives it its name.
    ///
    /// # Errors
    /// As [`DatasetWriter::finish`].
    pub fn finish(mut self) -> Result<(), DatasetError> {
        let metadata = self.metadata().to_string();
        self.file(&self.data.join("metadata.json"), metadata.as_bytes())?;
        self.folder.publish()
    }

    fn file(&mut self, path: &Path, bytes: &[u8]) -> Result<(), DatasetError> {
        self.bytes += bytes.len() as u64;
        fs::write(path, bytes).map_err(DatasetError::file(path))
    }

    fn metadata(&self) -> Value {
        let Metadata { name, policy, version, .. } = &self.metadata;
        // In units of a million bytes, with one digit after the point.
        let size = (self.bytes as f64 / 1e5).round() / 10.0;
        let mut metadata = json!({
            "dataset_id": name,
            "minari_version": VERSION,
            "data_format": "arrow",
            "jpeg_encoding": false,
            "total_episodes": self.episodes,
            "total_steps": self.steps,
            "dataset_size": size,
            "algorithm_name": policy,
            "description": self.metadata.sentence(),
            "requirements": [format!("fetch-env>={version}")],
            "fetch": self.metadata,
        });
        if self.metadata.task.is_none() {
            metadata["env_spec"] = own_spec(&self.metadata).to_string().into();
            metadata["eval_env_spec"] = robotics_spec(&self.metadata).to_string().into();
        }
        let spaces = [
            ("observation_space", &self.metadata.observation_space),
            ("action_space", &self.metadata.action_space),
        ];
        for (key, space) in spaces {
            if let Some(json) = space_json(space) {
                metadata[key] = json.into();
            }
        }
        metadata
    }
}

impl DatasetWriter for MinariWriter {
    fn write(&mut self, episode: &EpisodeRecord) -> Result<(), DatasetError> {
        Self::write(self, episode)
    }

    fn needs_snapshots(&self) -> bool {
        self.has_snapshots
    }

    fn finish(self: Box<Self>) -> Result<(), DatasetError> {
        Self::finish(*self)
    }
}
