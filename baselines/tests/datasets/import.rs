//! Minari data sets in a replay buffer.

use std::fs;
use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::process::Command;

use baselines::datasets::{MinariError, import_minari};
use her_relabel::{BufferConfig, Dims, EpisodeData, HerBuffer};
use proptest::prelude::*;
use tempfile::TempDir;

use crate::{NAME, Result, archive, buffer, collected, records, write};

const DIMS: Dims = Dims { observation: 2, goal: 1, action: 1 };

/// Two episodes that Minari 0.5.4 wrote: one of three steps, and one of five that terminates and
/// whose goal changes at the third state. `what_minari_wrote_has_the_same_bits` lists their
/// numbers.
fn by_minari() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/datasets/by_minari")
}

/// A copy of that set with a changed file of its first episode or changed metadata.
fn changed(name: &str, change: impl FnOnce(&mut Vec<u8>)) -> Result<TempDir> {
    let folder = tempfile::tempdir()?;
    for episode in ["data/0", "data/1"] {
        fs::create_dir_all(folder.path().join(episode))?;
    }
    for file in ["data/metadata.json", "data/0/part-0.arrow", "data/1/part-0.arrow"] {
        fs::copy(by_minari().join(file), folder.path().join(file))?;
    }
    let path = folder.path().join(name);
    let mut bytes = fs::read(&path)?;
    change(&mut bytes);
    fs::write(path, bytes)?;
    Ok(folder)
}

/// Replaces a text wherever it occurs.
fn replace(bytes: &mut [u8], from: &str, to: &str) {
    assert_eq!(from.len(), to.len());
    for at in 0..bytes.len() - from.len() {
        let part = &mut bytes[at..at + from.len()];
        if part == from.as_bytes() {
            part.copy_from_slice(to.as_bytes());
        }
    }
}

fn small(dims: Dims) -> Result<HerBuffer<f64>> {
    Ok(HerBuffer::new(BufferConfig::new(20, dims))?)
}

/// Imports a set into a buffer with an episode, and returns why that failed if it did.
fn refusal(folder: &Path, dims: Dims) -> Result<Option<MinariError>> {
    let mut buffer = small(dims)?;
    let zeros = [0.0; 10];
    buffer.add_episode(&EpisodeData {
        observation: &zeros[..2 * dims.observation],
        achieved_goal: &zeros[..2 * dims.goal],
        desired_goal: &zeros[..dims.goal],
        action: &zeros[..dims.action],
        reward: &[-1.0],
        terminated: false,
        truncated: true,
        fields: &[],
    })?;
    let before = archive(&buffer)?;
    let error = import_minari(&mut buffer, folder).err();
    if error.is_some() {
        assert!(archive(&buffer)? == before, "an error changes nothing");
    }
    Ok(error)
}

/// Returns why a changed set is refused.
fn refused(name: &str, change: fn(&mut Vec<u8>)) -> Result<MinariError> {
    let folder = changed(name, change)?;
    Ok(refusal(folder.path(), DIMS)?.ok_or("imported")?)
}

#[test]
fn the_buffer_imports_what_it_would_have_collected() -> Result {
    let folder = tempfile::tempdir()?;
    let records = records(13)?;
    write(folder.path(), &records)?;
    let mut imported = buffer()?;
    assert_eq!(import_minari(&mut imported, folder.path().join("minari").join(NAME))?, 13);
    assert!(archive(&imported)? == archive(&collected(&records)?)?);
    Ok(())
}

#[test]
fn what_minari_wrote_has_the_same_bits() -> Result {
    let mut imported = small(DIMS)?;
    assert_eq!(import_minari(&mut imported, by_minari())?, 3);
    let mut expected = small(DIMS)?;
    // The goal of a step is that of the state that it leads to.
    for (episode, states, goal, terminated) in
        [(0, 0..4, 0.5, false), (1, 0..3, 1.5, false), (1, 2..6, 2.5, true)]
    {
        let states = states.map(f64::from);
        let steps = states.clone().take(states.len() - 1);
        let observe = |state: f64| [f64::from(episode) + state / 3.0, state / 7.0];
        expected.add_episode(&EpisodeData {
            observation: &states.clone().flat_map(observe).collect::<Vec<_>>(),
            achieved_goal: &states.map(|state| state / 9.0).collect::<Vec<_>>(),
            desired_goal: &[goal],
            action: &steps.clone().map(|step| ((step - 1.0) / 5.0) as f32).collect::<Vec<_>>(),
            reward: &steps.map(|step| -((step + 1.0) / 11.0)).collect::<Vec<_>>(),
            terminated,
            truncated: !terminated,
            fields: &[],
        })?;
    }
    assert!(archive(&imported)? == archive(&expected)?);
    Ok(())
}

#[test]
fn what_is_no_set_with_goals_is_refused() -> Result {
    let first = "data/0/part-0.arrow";
    let error = refused("data/metadata.json", |bytes| replace(bytes, "\"arrow\"", "\"hdf5\" "))?;
    assert!(matches!(error, MinariError::Format { .. }), "{error}");
    let error =
        refused("data/metadata.json", |bytes| replace(bytes, "total_episodes", "episodes______"))?;
    assert!(matches!(error, MinariError::Metadata { .. }), "{error}");
    let error =
        refused("data/metadata.json", |bytes| replace(bytes, "episodes\": 2", "episodes\": 3"))?;
    assert!(matches!(error, MinariError::File { .. }), "{error}");
    let error = refused(first, |bytes| replace(bytes, "achieved_goal", "achieved-goal"))?;
    assert!(matches!(error, MinariError::Missing { .. }), "{error}");
    let error = refused(first, |bytes| replace(bytes, "rewards", "actions"))?;
    assert!(matches!(error, MinariError::Missing { .. }), "{error}");
    let error = refused(first, |bytes| replace(bytes, "ARROW1", "ARROW2"))?;
    assert!(matches!(error, MinariError::Arrow { .. }), "{error}");
    let error = refused(first, |bytes| bytes.truncate(2000))?;
    assert!(matches!(error, MinariError::Arrow { .. }), "{error}");
    let wider = Dims { observation: 3, ..DIMS };
    let error = refusal(&by_minari(), wider)?.ok_or("imported")?;
    assert!(matches!(error, MinariError::Width { actual: 2, expected: 3, .. }), "{error}");
    Ok(())
}

#[cfg(unix)]
#[test]
fn neither_a_pipe_nor_a_device_is_read() -> Result {
    for name in ["data/metadata.json", "data/1/part-0.arrow"] {
        let folder = changed(name, |_| ())?;
        let path = folder.path().join(name);
        fs::remove_file(&path)?;
        std::os::unix::fs::symlink("/dev/zero", &path)?;
        let device = refusal(folder.path(), DIMS)?.ok_or("imported")?;
        fs::remove_file(&path)?;
        assert!(Command::new("mkfifo").arg(&path).status()?.success());
        let pipe = refusal(folder.path(), DIMS)?.ok_or("imported")?;
        for error in [device, pipe] {
            assert!(format!("{error:?}").contains("is not a regular file"), "{error:?}");
        }
    }
    Ok(())
}

#[test]
fn numbers_that_no_buffer_takes_are_refused() -> Result {
    let folder = changed("data/1/part-0.arrow", |bytes| {
        let (third, infinity) = ((1.0 + 1.0 / 3.0_f64).to_le_bytes(), f64::INFINITY.to_le_bytes());
        let at = bytes.windows(8).position(|window| window == third).expect("an observation");
        bytes[at..at + 8].copy_from_slice(&infinity);
    })?;
    let error = refusal(folder.path(), DIMS)?.ok_or("imported")?;
    assert!(matches!(error, MinariError::Episode { episode: 1, .. }), "{error}");
    Ok(())
}

proptest! {
    #[test]
    fn damaged_files_are_refused_or_read(
        at in any::<prop::sample::Index>(),
        word in any::<[u8; 8]>(),
        len in 1..=8_usize,
        cut in any::<prop::sample::Index>(),
    ) {
        let folder = changed("data/0/part-0.arrow", |bytes| {
            let place = at.index(bytes.len() - len);
            bytes[place..place + len].copy_from_slice(&word[..len]);
        }).unwrap();
        refusal(folder.path(), DIMS).unwrap();
        let folder = changed("data/0/part-0.arrow", |bytes| {
            bytes.truncate(cut.index(bytes.len()));
        }).unwrap();
        let error = refusal(folder.path(), DIMS).unwrap();
        prop_assert!(matches!(error, Some(MinariError::Arrow { .. })), "{:?}", error);
    }
}
