//! Writes data sets in LeRobot's format.

use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use arrow_array::builder::{ListBuilder, StringBuilder};
use arrow_array::{Float64Array, Int64Array, RecordBatch, StringArray, UInt64Array};
use arrow_schema::Schema;
use fetch_env::Task;
use serde_json::{Map, Value, json};

use super::frames::{Feature, features, table};
use super::shards::{FILES_OF_CHUNK, Shard, Shards, Table};
use super::statistics::Statistics;
use crate::datasets::columns::Columns;
use crate::datasets::episode::EpisodeRecord;
use crate::datasets::error::DatasetError;
use crate::datasets::metadata::Metadata;
use crate::datasets::staged_folder::StagedFolder;
use crate::datasets::writer::DatasetWriter;

/// The size from which a file is full, in MiB.
const FILE_SIZE: usize = 100;

/// Writes a data set that LeRobot loads, in version 3.0 of its format, without video: a row for
/// each step, in Parquet files of about 100 MiB. Its id for LeRobot is the name of the data set
/// with `-` between all parts but the first: `fetch/push-expert-v0`.
///
/// | column | shape | type |
/// |---|---|---|
/// | `observation.state`: the observation before the step | `(dim,)` | `float64` |
/// | `observation.environment_state`: the desired goal, in meters | `(dim,)` | `float64` |
/// | `observation.achieved_goal`, in meters | `(dim,)` | `float64` |
/// | `action` | `(dim,)` | `float32` |
/// | `next.reward`, of the environment | `(1,)` | `float64` |
/// | `next.success`, `next.done`, `next.truncated` | `(1,)` | `bool` |
/// | `next.distance`, in meters; `next.sparse_reward`, `next.dense_reward` of the state after the step | `(1,)` | `float64` |
/// | `qpos`, `qvel` of the state before the step | `(dim,)` | `float64` |
///
/// There are also LeRobot's own columns: `timestamp`, `frame_index`, `episode_index`, `index` and
/// `task_index`. LeRobot's policies see states, environment states and actions, and its loader
/// converts all numbers to single precision. The format has no place for the state after the last
/// step. The metadata contain the seed of each episode, and statistics without quantiles.
#[derive(Debug)]
pub struct LeRobotWriter {
    metadata: Metadata,
    folder: StagedFolder,
    frames: Shards,
    episodes: Shards,
    /// The statistics of each column.
    statistics: Vec<Statistics>,
    num_episodes: i64,
    num_frames: i64,
}

impl LeRobotWriter {
    /// Begins a data set in a folder of data sets, which the environment variable `HF_LEROBOT_HOME`
    /// names for LeRobot.
    ///
    /// # Errors
    /// [`DatasetError::Exists`] if something with that name exists; [`DatasetError::File`] if a
    /// folder cannot be made.
    pub fn create(root: impl AsRef<Path>, metadata: Metadata) -> Result<Self, DatasetError> {
        let name = match metadata.name.split_once('/') {
            Some((first, rest)) => format!("{first}/{}", rest.replace('/', "-")),
            None => metadata.name.clone(),
        };
        let folder = StagedFolder::create(root.as_ref(), &name)?;
        let frames = Shards::new(folder.path().join("data"), FILE_SIZE << 20);
        let meta = folder.path().join("meta");
        fs::create_dir(&meta).map_err(DatasetError::file(&meta))?;
        let episodes = Shards::new(meta.join("episodes"), FILE_SIZE << 20);
        let nothing = EpisodeRecord::default();
        let features = features(&nothing, &metadata, 0, 0)?;
        let statistics = features.iter().map(|feature| Statistics::new(feature.width)).collect();
        Ok(Self { metadata, folder, frames, episodes, statistics, num_episodes: 0, num_frames: 0 })
    }

    /// Writes the next episode.
    ///
    /// # Errors
    /// As [`DatasetWriter::write`], [`DatasetError::Length`] if there are no steps,
    /// [`DatasetError::Arrow`] and [`DatasetError::Parquet`].
    pub fn write(&mut self, episode: &EpisodeRecord) -> Result<(), DatasetError> {
        episode.check(&self.metadata)?;
        let steps = episode.rewards.len();
        if steps == 0 {
            return Err(DatasetError::Length { column: "rewards", actual: 0, expected: 1 });
        }
        let features = features(episode, &self.metadata, self.num_episodes, self.num_frames)?;
        let statistics: Vec<_> = features
            .iter()
            .map(|feature| Statistics::of(&feature.numbers(), feature.width))
            .collect();
        let shard = self.frames.next()?;
        self.frames.write(&table(&features, steps)?)?;
        let row = self.episode(episode, shard, &features, &statistics)?;
        self.episodes.write(&row)?;
        for (all, new) in self.statistics.iter_mut().zip(&statistics) {
            all.add(new);
        }
        self.num_episodes += 1;
        self.num_frames += steps as i64;
        Ok(())
    }

    /// Returns the row of an episode in the table of episodes.
    fn episode(
        &mut self,
        episode: &EpisodeRecord,
        shard: Shard,
        features: &[Feature<'_>],
        statistics: &[Statistics],
    ) -> Result<RecordBatch, DatasetError> {
        let own_shard = self.episodes.next()?;
        let steps = episode.rewards.len() as i64;
        let mut tasks = ListBuilder::new(StringBuilder::new());
        tasks.values().append_value(task(&self.metadata));
        tasks.append(true);
        let mut row = Columns::new(1);
        row.column("tasks", tasks.finish());
        let numbers = [
            ("episode_index", self.num_episodes),
            ("length", steps),
            ("data/chunk_index", shard.chunk),
            ("data/file_index", shard.file),
            ("dataset_from_index", self.num_frames),
            ("dataset_to_index", self.num_frames + steps),
            ("meta/episodes/chunk_index", own_shard.chunk),
            ("meta/episodes/file_index", own_shard.file),
        ];
        for (name, number) in numbers {
            row.column(name, Int64Array::from(vec![number]));
        }
        row.column("seed", UInt64Array::from(vec![episode.seed]));
        for (Feature { name, .. }, statistics) in features.iter().zip(statistics) {
            let Statistics { count, min, max, mean, .. } = statistics;
            let parts = [("min", min), ("max", max), ("mean", mean), ("std", &statistics.std())];
            for (part, numbers) in parts {
                let numbers = Float64Array::from(numbers.clone());
                row.rows(&format!("stats/{name}/{part}"), numbers)?;
            }
            let count = Int64Array::from(vec![*count as i64]);
            row.rows(&format!("stats/{name}/count"), count)?;
        }
        Ok(row.into_table()?)
    }

    /// Finishes the data set and gives it its name.
    ///
    /// # Errors
    /// As [`DatasetWriter::finish`], and [`DatasetError::Parquet`].
    pub fn finish(mut self) -> Result<(), DatasetError> {
        if self.num_episodes == 0 {
            return Err(DatasetError::TooFew { episodes: 0, least: 1 });
        }
        self.frames.close()?;
        self.episodes.close()?;
        self.write_tasks()?;
        let nothing = EpisodeRecord::default();
        let features = features(&nothing, &self.metadata, 0, 0)?;
        let described = features.iter().map(|feature| (feature.name.into(), feature.describe()));
        let info = json!({
            "codebase_version": "v3.0",
            "robot_type": "fetch",
            "total_episodes": self.num_episodes,
            "total_frames": self.num_frames,
            "total_tasks": 1,
            "chunks_size": FILES_OF_CHUNK,
            "data_files_size_in_mb": FILE_SIZE,
            "fps": self.metadata.steps_per_second.round() as i64,
            "splits": { "train": format!("0:{}", self.num_episodes) },
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": null,
            "features": described.collect::<Map<String, Value>>(),
        });
        let named = features.iter().zip(&self.statistics);
        let statistics: Map<String, Value> =
            named.map(|(feature, all)| (feature.name.into(), all.describe())).collect();
        self.folder.write_json("meta/info.json", &info)?;
        self.folder.write_json("meta/stats.json", &statistics)?;
        self.folder.write_json("about.json", &self.metadata)?;
        self.folder.publish()
    }

    /// Writes the table of tasks, whose rows pandas finds by their names.
    fn write_tasks(&self) -> Result<(), DatasetError> {
        let mut tasks = Columns::new(1);
        tasks.column("task_index", Int64Array::from(vec![0]));
        tasks.column("task", StringArray::from(vec![task(&self.metadata)]));
        let tasks = tasks.into_table()?;
        let column = |name, pandas_type, numpy_type| {
            json!({
                "name": name,
                "field_name": name,
                "pandas_type": pandas_type,
                "numpy_type": numpy_type,
                "metadata": null,
            })
        };
        let pandas = json!({
            "index_columns": ["task"],
            "column_indexes": [],
            "columns": [
                column("task_index", "int64", "int64"),
                column("task", "unicode", "object"),
            ],
            "pandas_version": "2.0.0",
        });
        let metadata = HashMap::from([("pandas".to_owned(), pandas.to_string())]);
        let schema = Schema::clone(&tasks.schema()).with_metadata(metadata);
        let tasks = tasks.with_schema(Arc::new(schema))?;
        let mut table = Table::create(self.folder.path().join("meta/tasks.parquet"), &tasks)?;
        table.write(&tasks)?;
        table.close()
    }
}

impl DatasetWriter for LeRobotWriter {
    fn write(&mut self, episode: &EpisodeRecord) -> Result<(), DatasetError> {
        Self::write(self, episode)
    }

    fn finish(self: Box<Self>) -> Result<(), DatasetError> {
        Self::finish(*self)
    }
}

/// Returns the task in words, for LeRobot's policies.
const fn task(metadata: &Metadata) -> &'static str {
    match metadata.env_id.task {
        Task::Reach => "Move the gripper to the target.",
        Task::Push => "Push the block to the target.",
        Task::PickAndPlace => "Move the block to the target, on the table or above it.",
        Task::Slide => "Slide the puck to the target.",
    }
}
