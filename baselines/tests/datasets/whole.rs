//! Data sets appear whole or not at all.

use std::fs;
use std::io::{self, Read};
use std::iter;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use baselines::datasets::{DatasetError, Metadata, MinariWriter, OgBenchWriter};
use fetch_env::make;
use serde_json::Value;

use crate::{NAME, Result, metadata, records, write, writers};

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
    assert_eq!(fs::read_dir(folder.path())?.count(), 0);
    // Folders that were there stay, and the new ones with something of the user.
    fs::create_dir_all(folder.path().join("minari/fetch"))?;
    let [minari, ogbench] = writers(folder.path())?;
    fs::write(folder.path().join("ogbench/notes.txt"), "a thesis")?;
    match ogbench.finish() {
        Err(DatasetError::TooFew { episodes: 0, least }) => assert_eq!(least, 2),
        other => return Err(format!("{other:?}").into()),
    }
    drop(minari);
    let mut left = names(folder.path())?;
    left.sort();
    assert_eq!(left, ["minari", "ogbench"]);
    assert_eq!(fs::read_dir(folder.path().join("minari/fetch"))?.count(), 0);
    assert_eq!(names(&folder.path().join("ogbench"))?, ["notes.txt"]);
    Ok(())
}

/// Returns all hidden folders and files below a folder.
fn hidden(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.starts_with('.') {
            found.push(path);
        } else if path.is_dir() {
            found.extend(hidden(&path)?);
        }
    }
    Ok(found)
}

#[test]
fn the_next_writer_removes_what_a_killed_process_left_and_nothing_else() -> Result {
    let folder = tempfile::tempdir()?;
    let out = folder.path().join("out");
    let mut child = forever(&out)?;
    while !out.join("0/minari").exists() || hidden(&out)?.is_empty() {
        assert!(child.try_wait()?.is_none(), "it writes until it is killed");
    }
    let writing = writers(&folder.path().join("writing"))?;
    child.kill()?;
    child.wait()?;
    // The user's own folders, which look alike.
    let place = out.join("0/minari");
    let own = [".thesis", ".mixed-v0.backup", ".mixed-v0.AbCdEf", ".mixed-v0.aBcDeF"];
    for name in own {
        fs::create_dir(place.join(name))?;
    }
    fs::write(place.join(".mixed-v0.AbCdEf/unfinished"), "a thesis")?;
    let copied = hidden(&folder.path().join("writing"))?.pop().ok_or("none")?.join("unfinished");
    fs::copy(copied, place.join(".mixed-v0.aBcDeF/unfinished"))?;
    fs::write(place.join(".mixed-v0.aBcDeF/thesis.txt"), "a thesis")?;
    let sets = names(&out)?;
    for set in &sets {
        let metadata = Metadata::new("fetch/push/other-v0", &make("FetchPush-v4")?, "", "")?;
        drop(MinariWriter::create(out.join(set).join("minari"), metadata.clone())?);
        drop(OgBenchWriter::create(out.join(set).join("ogbench"), metadata)?);
    }
    let mut kept = hidden(&out)?;
    kept.sort();
    let mut expected = own.map(|name| place.join(name));
    expected.sort();
    assert_eq!(kept, expected);
    // A process that still writes is not disturbed.
    let before = hidden(&folder.path().join("writing"))?.len();
    drop(writers(&folder.path().join("writing"))?);
    assert_eq!(hidden(&folder.path().join("writing"))?.len(), before);
    for (mut writer, record) in writing.into_iter().zip(iter::repeat(&records(2)?)) {
        record.iter().try_for_each(|record| writer.write(record))?;
        writer.finish()?;
    }
    kept = hidden(folder.path())?;
    kept.sort();
    assert_eq!(kept, expected);
    Ok(())
}

#[test]
fn folders_that_a_killed_process_made_are_removed_if_nothing_is_in_them() -> Result {
    let folder = tempfile::tempdir()?;
    let out = folder.path().join("out");
    let mut child = forever(&out)?;
    // It is killed before the first data set has a name.
    while !out.join("0/minari").exists() || hidden(&out)?.is_empty() {
        assert!(child.try_wait()?.is_none(), "it writes until it is killed");
    }
    child.kill()?;
    child.wait()?;
    for entry in fs::read_dir(out.join("0"))? {
        let path = entry?.path();
        if !path.ends_with("minari") {
            fs::remove_dir_all(path)?;
        }
    }
    // A folder without a written file has no mark yet that says whose it is.
    let is_marked = |folder: &PathBuf| {
        let mut files = fs::read_dir(folder).into_iter().flatten().flatten();
        files.any(|file| file.metadata().is_ok_and(|data| data.is_file() && data.len() > 0))
    };
    let left = hidden(&out)?;
    if left.is_empty() || !left.iter().all(is_marked) || out.join("0/minari").join(NAME).exists() {
        // It was killed a moment too early or too late.
        return Ok(());
    }
    drop(MinariWriter::create(out.join("0/minari"), metadata()?)?);
    assert_eq!(fs::read_dir(folder.path())?.count(), 0);
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

/// Starts that process.
fn forever(folder: &Path) -> io::Result<Child> {
    Command::new(std::env::current_exe()?)
        .args(["--exact", "whole::writes_forever", "--ignored"])
        .env("BASELINES_WRITES_TO", folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
}

#[test]
fn a_crash_while_writing_leaves_whole_sets() -> Result {
    let (mut whole, mut broken_off) = (0, 0);
    for wait in 0..12 {
        let folder = tempfile::tempdir()?;
        let mut child = forever(folder.path())?;
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
        }
    }
    assert!(whole > 0 && broken_off > 0, "{whole} whole, {broken_off} broken off");
    Ok(())
}
