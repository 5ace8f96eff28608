//! Writes data sets in OGBench's format.

use std::fs::File;
use std::io;
use std::iter;
use std::path::Path;

use super::column::Column;
use crate::archive::Archive;
use crate::datasets::episode::EpisodeRecord;
use crate::datasets::error::DatasetError;
use crate::datasets::metadata::Metadata;
use crate::datasets::staged_folder::StagedFolder;
use crate::datasets::writer::DatasetWriter;
use crate::dims::lengths_of;
use crate::policy::PolicyError;

/// One of this many episodes is for validation: the second, and then every tenth.
const VALIDATION: usize = 10;

/// Writes a data set that OGBench's `load_dataset` reads: a folder with `NAME.npz` for training,
/// `NAME-val.npz` for validation, and `about.json`. NAME is the data set's name with `-` between
/// its parts. Of ten episodes in a row, the second is for validation.
///
/// The arrays for `E` episodes of `N` steps in total have a row for each of the `N + E` states,
/// where the last state of an episode has no step: its action and reward are zeros.
///
/// | array | shape | type |
/// |---|---|---|
/// | `observations`, `achieved_goals`, `desired_goals` | `(N + E, dim)` | `f8` |
/// | `actions` | `(N + E, dim)` | `f4` |
/// | `terminals`: whether the state is the last of its episode | `(N + E,)` | `bool` |
/// | `qpos`, `qvel` | `(N + E, dim)` | `f8` |
/// | `rewards`, of the environment | `(N + E,)` | `f8` |
/// | `distances`, in meters; `sparse_rewards`, `dense_rewards` of each state | `(N + E,)` | `f8` |
/// | `is_success` | `(N + E,)` | `bool` |
/// | `seeds` | `(E,)` | `u8` (64 bits) |
///
/// OGBench itself reads `observations`, `actions`, `terminals`, `qpos` and `qvel`, and converts
/// observations to single precision.
#[derive(Debug)]
pub struct OgBenchWriter {
    metadata: Metadata,
    folder: StagedFolder,
    training: Part,
    validation: Part,
    episodes: usize,
}

impl OgBenchWriter {
    /// Begins a data set in a folder of data sets.
    ///
    /// # Errors
    /// [`DatasetError::Exists`] if something with that name exists; [`DatasetError::File`] if files
    /// cannot be made.
    pub fn create(root: impl AsRef<Path>, metadata: Metadata) -> Result<Self, DatasetError> {
        let folder = StagedFolder::create(root.as_ref(), &file_name(&metadata))?;
        let [observation, goal, action] =
            lengths_of(&metadata.observation_space, &metadata.action_space)
                .map_err(PolicyError::from)?;
        let part = || {
            Part::create(folder.path(), [observation, goal, action], metadata.states)
                .map_err(DatasetError::file(folder.path()))
        };
        Ok(Self { training: part()?, validation: part()?, metadata, folder, episodes: 0 })
    }

    /// Writes the next episode.
    ///
    /// # Errors
    /// As [`DatasetWriter::write`].
    pub fn write(&mut self, episode: &EpisodeRecord) -> Result<(), DatasetError> {
        episode.check(&self.metadata)?;
        let is_validation = self.episodes % VALIDATION == 1;
        let part = if is_validation { &mut self.validation } else { &mut self.training };
        part.add(episode).map_err(DatasetError::file(self.folder.path()))?;
        self.episodes += 1;
        Ok(())
    }

    /// Finishes the data set and gives it its name.
    ///
    /// # Errors
    /// As [`DatasetWriter::finish`].
    pub fn finish(self) -> Result<(), DatasetError> {
        let Self { metadata, folder, training, validation, episodes } = self;
        if episodes < 2 {
            return Err(DatasetError::TooFew { episodes, least: 2 });
        }
        let name = file_name(&metadata);
        for (part, name) in
            [(training, format!("{name}.npz")), (validation, format!("{name}-val.npz"))]
        {
            let path = folder.path().join(name);
            part.write_to(&path).map_err(DatasetError::file(&path))?;
        }
        folder.write_json("about.json", &metadata)?;
        folder.publish()
    }
}

impl DatasetWriter for OgBenchWriter {
    fn write(&mut self, episode: &EpisodeRecord) -> Result<(), DatasetError> {
        Self::write(self, episode)
    }

    fn finish(self: Box<Self>) -> Result<(), DatasetError> {
        Self::finish(*self)
    }
}

/// Returns the name of the folder and of the archives.
fn file_name(metadata: &Metadata) -> String {
    metadata.name.replace('/', "-")
}

/// The arrays of an archive.
#[derive(Debug)]
struct Part {
    /// Columns with a row for each state, in the order of [`create`](Self::create).
    observations: Column,
    actions: Column,
    terminals: Column,
    qpos: Column,
    qvel: Column,
    achieved_goals: Column,
    desired_goals: Column,
    rewards: Column,
    distances: Column,
    sparse_rewards: Column,
    dense_rewards: Column,
    is_success: Column,
    /// An element for each episode.
    seeds: Column,
    action: usize,
}

impl Part {
    fn create(
        folder: &Path,
        [observation, goal, action]: [usize; 3],
        [qpos, qvel]: [usize; 2],
    ) -> io::Result<Self> {
        let doubles = |name, width| Column::create::<f64>(name, width, folder);
        Ok(Self {
            observations: doubles("observations", Some(observation))?,
            actions: Column::create::<f32>("actions", Some(action), folder)?,
            terminals: Column::create::<bool>("terminals", None, folder)?,
            qpos: doubles("qpos", Some(qpos))?,
            qvel: doubles("qvel", Some(qvel))?,
            achieved_goals: doubles("achieved_goals", Some(goal))?,
            desired_goals: doubles("desired_goals", Some(goal))?,
            rewards: doubles("rewards", None)?,
            distances: doubles("distances", None)?,
            sparse_rewards: doubles("sparse_rewards", None)?,
            dense_rewards: doubles("dense_rewards", None)?,
            is_success: Column::create::<bool>("is_success", None, folder)?,
            seeds: Column::create::<u64>("seeds", None, folder)?,
            action,
        })
    }

    fn add(&mut self, episode: &EpisodeRecord) -> io::Result<()> {
        let steps = episode.rewards.len();
        self.observations.extend(episode.observations.iter().copied())?;
        self.actions
            .extend(episode.actions.iter().copied().chain(iter::repeat_n(0.0, self.action)))?;
        self.terminals.extend((0..=steps).map(|state| state == steps))?;
        self.qpos.extend(episode.qpos.iter().copied())?;
        self.qvel.extend(episode.qvel.iter().copied())?;
        self.achieved_goals.extend(episode.achieved_goals.iter().copied())?;
        self.desired_goals.extend(episode.desired_goals.iter().copied())?;
        self.rewards.extend(episode.rewards.iter().copied().chain([0.0]))?;
        self.distances.extend(episode.distances.iter().copied())?;
        self.sparse_rewards.extend(episode.sparse_rewards.iter().copied())?;
        self.dense_rewards.extend(episode.dense_rewards.iter().copied())?;
        self.is_success.extend(episode.is_success.iter().copied())?;
        self.seeds.extend([episode.seed])
    }

    fn write_to(self, path: &Path) -> io::Result<()> {
        let mut file = File::create_new(path)?;
        let mut archive = Archive::new(&mut file);
        let columns = [
            self.observations,
            self.actions,
            self.terminals,
            self.qpos,
            self.qvel,
            self.achieved_goals,
            self.desired_goals,
            self.rewards,
            self.distances,
            self.sparse_rewards,
            self.dense_rewards,
            self.is_success,
            self.seeds,
        ];
        columns.into_iter().try_for_each(|column| column.write_to(&mut archive))?;
        archive.finish()
    }
}
