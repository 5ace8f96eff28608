//! What holds for every recorded episode.

use baselines::datasets::{DatasetError, EpisodeRecord, Metadata};
use fetch_env::{EnvId, FetchConfig, FetchObservation, GoalEnvExt, RewardKind, Task, make};

use crate::{Result, bits, records, writers};

/// The numbers of a record, each by its bits.
fn all_bits(record: &EpisodeRecord) -> Vec<Vec<u64>> {
    let columns = [
        &record.observations,
        &record.achieved_goals,
        &record.desired_goals,
        &record.rewards,
        &record.distances,
        &record.sparse_rewards,
        &record.dense_rewards,
        &record.qpos,
        &record.qvel,
    ];
    columns.into_iter().map(|column| bits(column)).collect()
}

#[test]
fn seed_and_actions_give_the_episode_again() -> Result {
    let mut env = make("FetchPush-v4")?;
    for record in records(8)? {
        let mut actions = record.actions.chunks(4);
        let mut replay = |_: &FetchObservation, action: &mut [f32]| {
            action.copy_from_slice(actions.next().unwrap_or(&[f32::NAN; 4]));
        };
        let mut again = EpisodeRecord::default();
        again.record(&mut env, &mut replay, record.seed)?;
        assert_eq!(all_bits(&again), all_bits(&record));
        assert_eq!(again, record);
    }
    Ok(())
}

#[test]
fn rewards_are_those_of_the_goals() -> Result {
    let kinds = [RewardKind::Sparse, RewardKind::Dense].map(|reward| {
        let task = Task::Push;
        make(EnvId { task, reward })
    });
    let [sparse, dense] = kinds;
    let (sparse, dense) = (sparse?, dense?);
    for record in records(8)? {
        let goals = record.achieved_goals.chunks(3).zip(record.desired_goals.chunks(3));
        for (state, (achieved, desired)) in goals.enumerate() {
            let expected = [&sparse, &dense].map(|env| env.compute_reward(achieved, desired));
            let [sparse_reward, dense_reward] = expected;
            assert_eq!(record.sparse_rewards[state].to_bits(), sparse_reward?.to_bits());
            assert_eq!(record.dense_rewards[state].to_bits(), dense_reward?.to_bits());
            assert_eq!(record.is_success[state], sparse.is_success(achieved, desired));
        }
        assert_eq!(bits(&record.rewards), bits(&record.sparse_rewards[1..]));
        assert_eq!(record.truncations.iter().filter(|cut_off| **cut_off).count(), 1);
        assert_eq!(record.truncations.last(), Some(&true));
    }
    Ok(())
}

#[test]
fn only_names_and_environments_that_others_know_are_described() -> Result {
    let env = make("FetchPush-v4")?;
    for name in ["", "push", "push-v", "push-v0/", "/push-v0", "../push-v0", "a b-v0", "push-v0x"] {
        let error = Metadata::new(name, &env, "", "").err().ok_or(name)?;
        assert!(matches!(error, DatasetError::Name { .. }), "{name}: {error}");
    }
    let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_target_range(0.1)?;
    let error = Metadata::new("push-v0", &make(config)?, "", "").err().ok_or("described")?;
    assert!(matches!(error, DatasetError::Settings { .. }), "{error}");
    Ok(())
}

#[test]
fn a_number_that_cannot_be_learned_from_is_refused_by_each_writer() -> Result {
    let folder = tempfile::tempdir()?;
    type Column = fn(&mut EpisodeRecord) -> &mut Vec<f64>;
    let columns: [(&str, Column); 9] = [
        ("observations", |record| &mut record.observations),
        ("achieved_goals", |record| &mut record.achieved_goals),
        ("desired_goals", |record| &mut record.desired_goals),
        ("rewards", |record| &mut record.rewards),
        ("distances", |record| &mut record.distances),
        ("sparse_rewards", |record| &mut record.sparse_rewards),
        ("dense_rewards", |record| &mut record.dense_rewards),
        ("qpos", |record| &mut record.qpos),
        ("qvel", |record| &mut record.qvel),
    ];
    let whole = records(1)?.remove(0);
    for mut writer in writers(folder.path())? {
        for number in [f64::NAN, f64::INFINITY, -1e300] {
            for (name, column) in columns {
                let mut record = whole.clone();
                column(&mut record)[2] = number;
                match writer.write(&record) {
                    Err(DatasetError::NotFinite { column, index: 2, .. }) => {
                        assert_eq!(column, name);
                    }
                    written => panic!("{name}: {written:?}"),
                }
            }
            let mut record = whole.clone();
            record.actions[2] = number as f32;
            let error = writer.write(&record).err().ok_or("written")?;
            assert!(error.to_string().starts_with("actions[2] is "), "{error}");
        }
        writer.write(&whole)?;
    }
    Ok(())
}

#[test]
fn an_episode_of_another_task_is_refused() -> Result {
    let folder = tempfile::tempdir()?;
    let mut env = make("FetchReach-v4")?;
    let mut record = EpisodeRecord::default();
    record.record(&mut env, &mut baselines::ZeroPolicy, 0)?;
    for mut writer in writers(folder.path())? {
        let error = writer.write(&record).err().ok_or("written")?;
        assert!(matches!(error, DatasetError::Length { column: "observations", .. }), "{error}");
    }
    let mut record = records(1)?.remove(0);
    record.actions.pop();
    for mut writer in writers(folder.path())? {
        let error = writer.write(&record).err().ok_or("written")?;
        let expected = "actions has 199 elements: expected 200";
        assert_eq!(error.to_string(), expected);
    }
    Ok(())
}
