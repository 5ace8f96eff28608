//! What LeRobot's files hold, read with Parquet.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use arrow_array::cast::AsArray;
use arrow_array::types::{ArrowPrimitiveType, Float32Type, Float64Type, Int64Type, UInt64Type};
use arrow_array::{Array, RecordBatch};
use baselines::datasets::EpisodeRecord;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::Value;

use crate::{Result, bits, records, write};

const STEPS: usize = 50;

/// Reads the tables of a file.
fn tables(path: &Path) -> Result<Vec<RecordBatch>> {
    let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(path)?)?.build()?;
    Ok(reader.collect::<std::result::Result<_, _>>()?)
}

/// Returns the elements of a column, of single numbers or of rows.
fn elements<T: ArrowPrimitiveType>(tables: &[RecordBatch], name: &str) -> Result<Vec<T::Native>> {
    let mut elements = Vec::new();
    for table in tables {
        let array = table.column_by_name(name).ok_or(name)?.as_ref();
        let rows = array.as_fixed_size_list_opt();
        let array: &dyn Array = rows.map_or(array, |rows| rows.values().as_ref());
        elements.extend_from_slice(array.as_primitive::<T>().values());
    }
    Ok(elements)
}

fn flags(tables: &[RecordBatch], name: &str) -> Result<Vec<bool>> {
    let mut flags = Vec::new();
    for table in tables {
        flags.extend(table.column_by_name(name).ok_or(name)?.as_boolean().values());
    }
    Ok(flags)
}

/// Writes a set of Push, and returns its folder.
fn written(folder: &Path, records: &[EpisodeRecord]) -> Result<PathBuf> {
    write(folder, records)?;
    Ok(folder.join("lerobot/fetch/push-mixed-v0"))
}

fn json(path: &Path) -> Result<Value> {
    Ok(serde_json::from_slice(&fs::read(path)?)?)
}

#[test]
fn what_was_written_reads_back_with_the_same_bits() -> Result {
    let folder = tempfile::tempdir()?;
    let records = records(5)?;
    let set = written(folder.path(), &records)?;
    let tables = tables(&set.join("data/chunk-000/file-000.parquet"))?;
    type Doubles = fn(&EpisodeRecord) -> &[f64];
    let columns: [(&str, Doubles); 9] = [
        ("observation.state", |record| &record.observations[..STEPS * 25]),
        ("observation.environment_state", |record| &record.desired_goals[..STEPS * 3]),
        ("observation.achieved_goal", |record| &record.achieved_goals[..STEPS * 3]),
        ("next.reward", |record| &record.rewards),
        ("next.distance", |record| &record.distances[1..]),
        ("next.sparse_reward", |record| &record.sparse_rewards[1..]),
        ("next.dense_reward", |record| &record.dense_rewards[1..]),
        ("qpos", |record| &record.qpos[..STEPS * 22]),
        ("qvel", |record| &record.qvel[..STEPS * 21]),
    ];
    for (name, column) in columns {
        let expected: Vec<_> = records.iter().flat_map(column).copied().collect();
        assert_eq!(bits(&elements::<Float64Type>(&tables, name)?), bits(&expected), "{name}");
    }
    let actions: Vec<_> = records.iter().flat_map(|record| record.actions.clone()).collect();
    assert_eq!(elements::<Float32Type>(&tables, "action")?, actions);
    let expected: Vec<_> = records.iter().flat_map(|record| &record.is_success[1..]).collect();
    assert_eq!(flags(&tables, "next.success")?.iter().collect::<Vec<_>>(), expected);
    let ends: Vec<_> = (1..=5 * STEPS).map(|step| step % STEPS == 0).collect();
    for name in ["next.done", "next.truncated"] {
        assert_eq!(flags(&tables, name)?, ends, "{name}");
    }
    type Count = fn(usize) -> usize;
    let counts: [(&str, Count); 4] = [
        ("index", |row| row),
        ("frame_index", |row| row % STEPS),
        ("episode_index", |row| row / STEPS),
        ("task_index", |_| 0),
    ];
    for (name, count) in counts {
        let expected: Vec<_> = (0..5 * STEPS).map(|row| count(row) as i64).collect();
        assert_eq!(elements::<Int64Type>(&tables, name)?, expected, "{name}");
    }
    let times: Vec<_> = (0..5 * STEPS).map(|row| ((row % STEPS) as f64 / 25.0) as f32).collect();
    assert_eq!(elements::<Float32Type>(&tables, "timestamp")?, times);
    Ok(())
}

#[test]
fn the_metadata_say_where_episodes_are() -> Result {
    let folder = tempfile::tempdir()?;
    let records = records(3)?;
    let set = written(folder.path(), &records)?;
    let info = json(&set.join("meta/info.json"))?;
    assert_eq!((&info["codebase_version"], &info["fps"]), (&"v3.0".into(), &25.into()));
    assert_eq!((&info["total_episodes"], &info["total_frames"]), (&3.into(), &150.into()));
    assert_eq!(info["features"]["observation.state"]["shape"], serde_json::json!([25]));
    assert_eq!(info["features"]["action"]["dtype"], "float32");
    let episodes = tables(&set.join("meta/episodes/chunk-000/file-000.parquet"))?;
    let numbers = |name| elements::<Int64Type>(&episodes, name);
    assert_eq!(numbers("dataset_from_index")?, [0, 50, 100]);
    assert_eq!(numbers("dataset_to_index")?, [50, 100, 150]);
    assert_eq!(numbers("length")?, [50; 3]);
    assert_eq!(elements::<UInt64Type>(&episodes, "seed")?, [0, 1, 2]);
    let tasks = tables(&set.join("meta/tasks.parquet"))?;
    let task = tasks[0].column_by_name("task").ok_or("task")?.as_string::<i32>().value(0);
    assert_eq!(task, "Push the block to the target.");
    Ok(())
}

#[test]
fn statistics_are_those_of_the_rows() -> Result {
    let folder = tempfile::tempdir()?;
    let records = records(3)?;
    let set = written(folder.path(), &records)?;
    let all = &json(&set.join("meta/stats.json"))?["action"];
    let third: Vec<_> =
        records.iter().flat_map(|record| record.actions[2..].iter().step_by(4)).collect();
    let third: Vec<_> = third.into_iter().map(|element| f64::from(*element)).collect();
    let mean = third.iter().sum::<f64>() / 150.0;
    let variance = third.iter().map(|element| (element - mean).powi(2)).sum::<f64>() / 150.0;
    assert_eq!(all["count"], serde_json::json!([150]));
    let parts = [
        ("min", third.iter().copied().fold(f64::INFINITY, f64::min)),
        ("max", third.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
        ("mean", mean),
        ("std", variance.sqrt()),
    ];
    for (part, expected) in parts {
        let found = all[part][2].as_f64().ok_or(part)?;
        assert!((found - expected).abs() < 1e-12, "{part}: {found}, {expected}");
    }
    let episodes = tables(&set.join("meta/episodes/chunk-000/file-000.parquet"))?;
    let most = elements::<Float64Type>(&episodes, "stats/next.reward/max")?;
    let expected: Vec<_> = records
        .iter()
        .map(|record| record.rewards.iter().copied().fold(f64::NEG_INFINITY, f64::max))
        .collect();
    assert_eq!(most, expected);
    Ok(())
}
