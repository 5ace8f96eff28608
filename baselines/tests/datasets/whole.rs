//! Data sets appear whole or not at all.

use std::fs;
use std::io::{self, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use baselines::datasets::DatasetError;
use serde_json::Value;

use crate::{NAME, Result, records, write, writers};

const EPISODES: usize = 20;

/// The names in a folder, except those that a killed process leaves.
fn names(folder: &Path) -> Result<Vec<String>> {
    let entries = fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name()));
    let names = entries.collect::<Result<Vec<_>>>()?;
    let names = names.into_iter().map(|name| name.to_string_lossy().into_owned());
    Ok(names.filter(|name| !name.starts_with('.')).collect())
}

#[test]
fn nothing_is_replaced() -> Result {
    let folder = tempfile::tempdir()?;
    let records = records(2)?;
    write(folder.path(), &records)?;
    let error = write(folder.path(), &records).err().ok_or("replaced")?;
    assert!(error.to_string().contains("exists already"), "{error}");
    Ok(())
}

#[test]
fn one_of_two_writers_finishes() -> Result {
    let folder = tempfile::tempdir()?;
    let records = records(2)?;
    for (mut first, mut second) in writers(folder.path())?.into_iter().zip(writers(folder.path())?)
    {
        for record in &records {
            first.write(record)?;
            second.write(record)?;
        }
        second.finish()?;
        let error = first.finish().err().ok_or("replaced")?;
        assert!(matches!(error, DatasetError::Exists { .. }), "{error}");
    }
    Ok(())
}

#[test]
fn a_writer_that_does_not_finish_leaves_nothing() -> Result {
    let folder = tempfile::tempdir()?;
    let records = records(1)?;
    for mut writer in writers(folder.path())? {
        writer.write(&records[0])?;
    }
    for place in ["minari/fetch/push", "ogbench", "lerobot/fetch"] {
        assert_eq!(fs::read_dir(folder.path().join(place))?.count(), 0, "{place}");
    }
    let [_, ogbench, lerobot] = writers(folder.path())?;
    for (writer, least, place) in [(ogbench, 2, "ogbench"), (lerobot, 1, "lerobot/fetch")] {
        match writer.finish() {
            Err(DatasetError::TooFew { episodes: 0, least: found }) => assert_eq!(found, least),
            other => return Err(format!("{other:?}").into()),
        }
        assert_eq!(fs::read_dir(folder.path().join(place))?.count(), 0);
    }
    Ok(())
}

/// The process that the next test starts and kills.
#[test]
#[ignore = "runs until it is killed"]
fn writes_forever() {
    let folder = std::env::var_os("BASELINES_WRITES_TO").unwrap();
    // It ends with its parent process, however that ends.
    let parent = thread::spawn(|| io::stdin().read_to_end(&mut Vec::new()));
    let records = records(EPISODES as u64).unwrap();
    let mut count = 0;
    while !parent.is_finished() {
        write(&Path::new(&folder).join(count.to_string()), &records).unwrap();
        count += 1;
    }
}

#[test]
fn a_crash_while_writing_leaves_whole_sets() -> Result {
    let (mut whole, mut broken_off) = (0, 0);
    for wait in 0..12 {
        let folder = tempfile::tempdir()?;
        let mut child = Command::new(std::env::current_exe()?)
            .args(["--exact", "whole::writes_forever", "--ignored"])
            .env("BASELINES_WRITES_TO", folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()?;
        // When the second folder is there, the first one is done.
        while names(folder.path())?.len() <= wait % 2 {
            assert!(child.try_wait()?.is_none(), "it writes until it is killed");
        }
        thread::sleep(Duration::from_millis(wait as u64 * 5));
        child.kill()?;
        child.wait()?;
        for set in names(folder.path())? {
            let minari = folder.path().join(&set).join("minari").join(NAME);
            if minari.exists() {
                let data = minari.join("data");
                let metadata = fs::read(data.join("metadata.json"))?;
                let metadata: Value = serde_json::from_slice(&metadata)?;
                assert_eq!(metadata["total_episodes"], EPISODES);
                // An episode is a folder of two files, and metadata.json is the last name.
                assert_eq!(names(&data)?.len(), EPISODES + 1);
                for episode in 0..EPISODES {
                    assert_eq!(names(&data.join(episode.to_string()))?.len(), 2);
                }
                whole += 1;
            } else {
                broken_off += 1;
            }
            let ogbench = folder.path().join(&set).join("ogbench/fetch-push-mixed-v0");
            if ogbench.exists() {
                assert_eq!(names(&ogbench)?.len(), 3);
                for file in ["fetch-push-mixed-v0.npz", "fetch-push-mixed-v0-val.npz"] {
                    let archive = fs::File::open(ogbench.join(file))?;
                    assert_eq!(zip::ZipArchive::new(archive)?.len(), 13);
                }
            }
            let lerobot = folder.path().join(&set).join("lerobot/fetch/push-mixed-v0");
            if lerobot.exists() {
                assert_eq!(names(&lerobot)?.len(), 3);
                assert_eq!(names(&lerobot.join("meta"))?.len(), 4);
                let info: Value =
                    serde_json::from_slice(&fs::read(lerobot.join("meta/info.json"))?)?;
                assert_eq!(info["total_episodes"], EPISODES);
            }
        }
    }
    assert!(whole > 0 && broken_off > 0, "{whole} whole, {broken_off} broken off");
    Ok(())
}
