//! What OGBench's files hold, read with npyz.

use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;

use baselines::datasets::EpisodeRecord;
use fetch_env::{GoalEnv, make};
use her_relabel::GoalColumns;
use npyz::{Deserialize, NpyFile};
use zip::ZipArchive;

use crate::{Result, archive, bits, buffer, collected, records, write};

/// Reads an array with its shape.
fn array<T: Deserialize>(path: &Path, name: &str) -> Result<(Vec<u64>, Vec<T>)> {
    let mut bytes = Vec::new();
    let mut archive = ZipArchive::new(File::open(path)?)?;
    archive.by_name(&format!("{name}.npy"))?.read_to_end(&mut bytes)?;
    let array = NpyFile::new(Cursor::new(bytes))?;
    Ok((array.shape().to_vec(), array.into_vec()?))
}

/// Puts a column of all episodes together, each with `last` at its end.
fn together<T: Clone>(
    records: &[&EpisodeRecord],
    column: fn(&EpisodeRecord) -> &Vec<T>,
    last: &[T],
) -> Vec<T> {
    records.iter().flat_map(|record| [&column(record)[..], last].concat()).collect()
}

#[test]
fn what_was_written_reads_back_with_the_same_bits() -> Result {
    let folder = tempfile::tempdir()?;
    let records = records(13)?;
    write(folder.path(), &records)?;
    let name = "fetch-push-mixed-v0";
    let folder = folder.path().join("ogbench").join(name);
    let is_validation = |record: &&EpisodeRecord| record.seed % 10 == 1;
    let (validation, training): (Vec<_>, Vec<_>) = records.iter().partition(is_validation);
    assert_eq!((training.len(), validation.len()), (11, 2));
    for (file, part) in [(name.to_owned(), training), (format!("{name}-val"), validation)] {
        let path = folder.join(file + ".npz");
        let states = 51 * part.len() as u64;
        type Doubles = fn(&EpisodeRecord) -> &Vec<f64>;
        let columns: [(&str, &[u64], Doubles, &[f64]); 9] = [
            ("observations", &[states, 25], |record| &record.observations, &[]),
            ("achieved_goals", &[states, 3], |record| &record.achieved_goals, &[]),
            ("desired_goals", &[states, 3], |record| &record.desired_goals, &[]),
            ("qpos", &[states, 22], |record| &record.qpos, &[]),
            ("qvel", &[states, 21], |record| &record.qvel, &[]),
            ("rewards", &[states], |record| &record.rewards, &[0.0]),
            ("distances", &[states], |record| &record.distances, &[]),
            ("sparse_rewards", &[states], |record| &record.sparse_rewards, &[]),
            ("dense_rewards", &[states], |record| &record.dense_rewards, &[]),
        ];
        for (name, expected_shape, column, last) in columns {
            let (shape, found) = array::<f64>(&path, name)?;
            assert_eq!(shape, expected_shape, "{name}");
            assert_eq!(bits(&found), bits(&together(&part, column, last)), "{name}");
        }
        let (shape, actions) = array::<f32>(&path, "actions")?;
        assert_eq!(shape, [states, 4]);
        assert_eq!(actions, together(&part, |record| &record.actions, &[0.0; 4]));
        let (_, successes) = array::<bool>(&path, "is_success")?;
        assert_eq!(successes, together(&part, |record| &record.is_success, &[]));
        let (_, terminals) = array::<bool>(&path, "terminals")?;
        let ends = (1..=states).map(|state| state % 51 == 0);
        assert_eq!(terminals, ends.collect::<Vec<_>>());
        let (_, seeds) = array::<u64>(&path, "seeds")?;
        assert_eq!(seeds, part.iter().map(|record| record.seed).collect::<Vec<_>>());
    }
    Ok(())
}

#[test]
fn the_buffer_imports_what_it_would_have_collected() -> Result {
    let folder = tempfile::tempdir()?;
    let records = records(13)?;
    write(folder.path(), &records)?;
    let path = folder.path().join("ogbench/fetch-push-mixed-v0/fetch-push-mixed-v0.npz");
    let goals = GoalColumns {
        array: "achieved_goals",
        width: 3,
        columns: 0..3,
        desired: Some("desired_goals"),
    };
    let env = make("FetchPush-v4")?;
    let mut imported = buffer()?;
    assert_eq!(imported.import_ogbench(&path, &goals, env.goal_reward())?, 11);
    let collected = collected(records.iter().filter(|record| record.seed % 10 != 1))?;
    assert!(archive(&imported)? == archive(&collected)?);
    Ok(())
}
