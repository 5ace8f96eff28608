//! What Minari's files hold, read with Arrow.

use std::fs::{self, File};
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::types::{ArrowPrimitiveType, Float32Type, Float64Type, UInt8Type};
use arrow_array::{Array, RecordBatch, StructArray};
use arrow_ipc::reader::FileReader;
use baselines::datasets::{EpisodeRecord, Metadata, MinariWriter, SetKind, SetPolicy};
use fetch_env::{Env, FetchSnapshot, GoalObservation, SnapshotEnv, make};
use serde_json::Value;

use crate::{NAME, Result, bits, metadata, records, write};

/// Reads the only table of a file.
fn table(path: &Path) -> Result<RecordBatch> {
    let mut reader = FileReader::try_new(File::open(path)?, None)?;
    let table = reader.next().ok_or("no table")??;
    assert!(reader.next().is_none());
    Ok(table)
}

/// Returns the elements of a column, of single numbers or of rows.
fn elements<T: ArrowPrimitiveType>(array: &dyn Array) -> Vec<T::Native> {
    let rows = array.as_fixed_size_list_opt();
    let array = rows.map_or(array, |rows| rows.values().as_ref());
    array.as_primitive::<T>().values().to_vec()
}

fn part<'a>(array: &'a StructArray, name: &str) -> Result<&'a dyn Array> {
    Ok(array.column_by_name(name).ok_or(name)?.as_ref())
}

#[test]
fn what_was_written_reads_back_with_the_same_bits() -> Result {
    let folder = tempfile::tempdir()?;
    let records = records(8)?;
    write(folder.path(), &records)?;
    let data = folder.path().join("minari").join(NAME).join("data");
    for (index, record) in records.iter().enumerate() {
        let episode = data.join(index.to_string());
        let metadata: Value = serde_json::from_slice(&fs::read(episode.join("metadata.json"))?)?;
        assert_eq!(metadata["seed"], record.seed);
        assert_eq!(metadata["total_steps"], 50);
        let table = table(&episode.join("part-0.arrow"))?;
        let column = |name: &str| table.column_by_name(name).ok_or(format!("no {name}"));
        let observations = column("observations")?.as_struct();
        let infos = column("infos")?.as_struct();
        let doubles = [
            (part(observations, "observation")?, &record.observations),
            (part(observations, "achieved_goal")?, &record.achieved_goals),
            (part(observations, "desired_goal")?, &record.desired_goals),
            (part(infos, "distance")?, &record.distances),
            (part(infos, "sparse_reward")?, &record.sparse_rewards),
            (part(infos, "dense_reward")?, &record.dense_rewards),
            (part(infos, "qpos")?, &record.qpos),
            (part(infos, "qvel")?, &record.qvel),
        ];
        for (array, expected) in doubles {
            assert_eq!(bits(&elements::<Float64Type>(array)), bits(expected));
        }
        let padded = |numbers: &[f64]| bits(&[numbers, &[0.0]].concat());
        let rewards = elements::<Float64Type>(column("rewards")?);
        assert_eq!(bits(&rewards), padded(&record.rewards));
        let actions = elements::<Float32Type>(column("actions")?);
        assert_eq!(actions, [&record.actions[..], &[0.0; 4]].concat());
        let successes = elements::<Float32Type>(part(infos, "is_success")?);
        let successes: Vec<_> = successes.iter().map(|success| *success == 1.0).collect();
        assert_eq!(successes, record.is_success);
        let flags = [("terminations", &record.terminations), ("truncations", &record.truncations)];
        for (name, expected) in flags {
            let found: Vec<_> = column(name)?.as_boolean().values().iter().collect();
            assert_eq!(found, [&expected[..], &[false]].concat());
        }
    }
    Ok(())
}

#[test]
fn an_episode_goes_on_from_each_of_its_snapshots() -> Result {
    let folder = tempfile::tempdir()?;
    let mut env = make("FetchPush-v4")?;
    let mut policy = SetPolicy::new(SetKind::ExpertNoisy, &env)?;
    policy.begin(5);
    let mut record = EpisodeRecord::default().with_snapshots();
    record.record(&mut env, &mut policy, 5)?;
    let mut writer = MinariWriter::create(folder.path(), metadata()?)?.with_snapshots();
    writer.write(&record)?;
    writer.finish()?;
    let table = table(&folder.path().join(NAME).join("data/0/part-0.arrow"))?;
    let infos = table.column_by_name("infos").ok_or("no infos")?.as_struct();
    let texts = elements::<UInt8Type>(part(infos, "snapshot")?);
    let texts: Vec<_> = texts.chunks(texts.len() / 51).collect();
    assert_eq!(texts.len(), 51);
    for (state, text) in texts.iter().enumerate() {
        let snapshot = &record.snapshots[state];
        assert_eq!(&serde_json::from_slice::<FetchSnapshot<_>>(text)?, snapshot.inner());
        env.restore(snapshot)?;
        for (action, later) in record.actions.chunks(4).zip(1..).skip(state) {
            let step = env.step(action)?;
            let expected = &record.observations[later * 25..][..25];
            assert_eq!(bits(step.observation.observation()), bits(expected));
            assert_eq!(step.truncated, later == 50);
        }
    }
    Ok(())
}

#[test]
fn snapshots_that_are_asked_for_must_be_there() -> Result {
    let folder = tempfile::tempdir()?;
    let mut writer = MinariWriter::create(folder.path(), metadata()?)?.with_snapshots();
    let error = writer.write(&records(1)?[0]).err().ok_or("written")?;
    assert_eq!(error.to_string(), "snapshots has 0 elements: expected 51");
    Ok(())
}

#[test]
fn the_metadata_say_what_the_set_is_of() -> Result {
    let folder = tempfile::tempdir()?;
    write(folder.path(), &records(2)?)?;
    let path = folder.path().join("minari").join(NAME).join("data/metadata.json");
    let metadata: Value = serde_json::from_slice(&fs::read(path)?)?;
    assert_eq!(metadata["dataset_id"], NAME);
    assert_eq!((&metadata["total_episodes"], &metadata["total_steps"]), (&2.into(), &100.into()));
    let spec = |key: &str| -> Result<Value> {
        Ok(serde_json::from_str(metadata[key].as_str().ok_or("no text")?)?)
    };
    assert_eq!(spec("env_spec")?["id"], "fetch_env/FetchPush-v4");
    assert_eq!(spec("env_spec")?["kwargs"]["env_id"], "FetchPush-v4");
    assert_eq!(spec("eval_env_spec")?["id"], "FetchPush-v4");
    let spaces = metadata["observation_space"].as_str().ok_or("no text")?;
    assert!(spaces.contains("-Infinity") && spaces.contains(r#""shape": [25]"#), "{spaces}");
    Ok(())
}

#[test]
fn a_set_of_a_task_of_ones_own_has_spaces_and_no_environment() -> Result {
    let folder = tempfile::tempdir()?;
    let mut env = make("FetchPush-v4")?;
    let mut policy = SetPolicy::new(SetKind::Random, &env)?;
    let name = Metadata::name_of_own("blocks.Two_Blocks", "random");
    assert_eq!(name, "fetch/two-blocks/random-v0");
    let task = Metadata::of_own_task(&name, "Two_Blocks", &env, policy.describe(), "")?;
    let mut writer = MinariWriter::create(folder.path(), task)?;
    let mut record = EpisodeRecord::default();
    policy.begin(0);
    record.record(&mut env, &mut policy, 0)?;
    writer.write(&record)?;
    writer.finish()?;
    let path = folder.path().join(name).join("data/metadata.json");
    let metadata: Value = serde_json::from_slice(&fs::read(path)?)?;
    assert_eq!(metadata["fetch"]["task"], "Two_Blocks");
    assert!(metadata["observation_space"].is_string());
    assert!(metadata["env_spec"].is_null() && metadata["eval_env_spec"].is_null());
    Ok(())
}
