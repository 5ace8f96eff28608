//! What a folder contains besides the checkpoints of a run: other runs' checkpoints, and files of
//! the user.

use std::collections::BTreeMap;
use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::Command;

use baselines::learn::{CheckpointError, Trainer, checkpoints};
use fetch_env::{EnvError, EnvId, FetchEnv, KinematicSimulator, make_kinematic};
use tempfile::tempdir;

use crate::ranks::on_ranks;
use crate::runs::{Kinematic, Result, ddpg, make, settings};

fn trainer(seed: u64) -> Result<Trainer<Kinematic>> {
    Ok(Trainer::new(make, settings(ddpg()), seed, 1)?)
}

/// The files of a folder and what is in them.
fn contents(folder: &Path) -> Result<BTreeMap<OsString, Vec<u8>>> {
    let file = |entry: fs::DirEntry| Ok((entry.file_name(), fs::read(entry.path())?));
    fs::read_dir(folder)?.map(|entry| file(entry?)).collect()
}

#[test]
fn checkpoints_of_another_run_are_neither_replaced_nor_removed_nor_continued() -> Result {
    let folder = tempdir()?;
    let mut first = trainer(1)?;
    for _ in 0..3 {
        first.cycle()?;
        first.save(folder.path())?;
    }
    let before = contents(folder.path())?;
    assert_eq!(before.len(), 2);
    // A run with the same settings and the same seed is a different run, too, at any number of
    // steps.
    for seed in [1, 2] {
        let mut other = trainer(seed)?;
        for cycles in 0..5 {
            if cycles > 0 {
                other.cycle()?;
            }
            match other.save(folder.path()) {
                Err(CheckpointError::OtherRun { path }) => assert!(path.is_file(), "{path:?}"),
                saved => panic!("{saved:?}"),
            }
            assert!(contents(folder.path())? == before, "seed {seed}, {cycles} cycles");
        }
    }
    let resumed = Trainer::resume(make, folder.path(), 1)?;
    assert_eq!((resumed.seed(), resumed.counters().steps), (1, 300));
    Ok(())
}

#[test]
fn what_was_saved_is_there_and_is_resumed() -> Result {
    let folder = tempdir()?;
    let mut trainer = trainer(1)?;
    for _ in 0..4 {
        trainer.cycle()?;
        let path = trainer.save(folder.path())?;
        assert_eq!(checkpoints(folder.path())?.last(), Some(&path));
        trainer = Trainer::resume(make, folder.path(), 1)?;
        assert_eq!(trainer.save(folder.path())?, path);
    }
    // Back at an earlier checkpoint, the later one is the run's own, but not older.
    let all = checkpoints(folder.path())?;
    let (before, last) = (&all[0], &all[1]);
    let aside = folder.path().join("aside.zip");
    fs::rename(last, &aside)?;
    let mut earlier = Trainer::resume(make, folder.path(), 1)?;
    fs::rename(&aside, last)?;
    assert_eq!(&earlier.save(folder.path())?, before);
    assert_eq!(checkpoints(folder.path())?, all);
    Ok(())
}

/// Makes an environment with a distance within which a goal counts as reached.
fn make_within(meters: f64) -> Result<Kinematic, EnvError> {
    let id: EnvId = "FetchReach-v4".parse()?;
    let config = id.config().with_distance_threshold(meters)?;
    let simulator = KinematicSimulator::new(config.sim());
    Ok(FetchEnv::new(config, simulator)?.time_limited())
}

#[test]
fn checkpoints_of_another_environment_are_refused_on_any_number_of_ranks() -> Result {
    let ids = EnvId::ALL.map(|id| id.to_string());
    for id in &ids {
        let (alone, shared) = (tempdir()?, tempdir()?);
        let make = || Ok(make_kinematic(id)?);
        Trainer::new(make, settings(ddpg()), 0, 1)?.save(alone.path())?;
        let saved = on_ranks(2, |workers| {
            Trainer::with_workers(make, settings(ddpg()), 0, 1, workers)?.save(shared.path())
        });
        saved.into_iter().collect::<Result<Vec<_>, _>>()?;
        for folder in [alone.path(), shared.path()] {
            for other in &ids {
                let resumed = Trainer::resume(|| Ok(make_kinematic(other)?), folder, 1);
                match resumed {
                    Ok(_) => assert_eq!(id, other),
                    Err(CheckpointError::Foreign { .. }) => assert_ne!(id, other),
                    Err(error) => panic!("{id} as {other}: {error}"),
                }
            }
        }
    }
    let folder = tempdir()?;
    trainer(1)?.save(folder.path())?;
    let other = Trainer::resume(|| make_within(0.02), folder.path(), 1);
    assert!(matches!(other, Err(CheckpointError::Foreign { .. })), "{other:?}");
    Trainer::resume(|| make_within(0.05), folder.path(), 1)?;
    Ok(())
}

#[cfg(unix)]
#[test]
fn links_and_files_of_a_user_stay_as_they_are() -> Result {
    let folder = tempdir()?;
    let (run, victim) = (folder.path().join("run"), folder.path().join("victim.txt"));
    fs::create_dir(&run)?;
    fs::write(&victim, "the user's")?;
    fs::write(run.join("checkpoint-best.zip"), "the user's")?;
    for name in ["unfinished.zip", "checkpoint-000000000100.zip", ".checkpoint-000000000000.zip"] {
        std::os::unix::fs::symlink("../victim.txt", run.join(name))?;
    }
    let before = contents(&run)?;
    let mut trainer = trainer(1)?;
    let path = trainer.save(&run)?;
    assert!(Trainer::resume(make, &run, 1).is_err(), "the last one is a link to no checkpoint");
    trainer.cycle()?;
    match trainer.save(&run) {
        Err(CheckpointError::OtherRun { path }) => {
            assert_eq!(path, run.join("checkpoint-000000000100.zip"));
        }
        saved => panic!("{saved:?}"),
    }
    fs::remove_file(path)?;
    assert!(contents(&run)? == before && fs::read_to_string(&victim)? == "the user's");
    Ok(())
}

/// Names the folder in which a process without space for files saves.
const FULL: &str = "SAVE_WITHOUT_SPACE_IN";

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_that_prints_nothing_and_leaves_nothing() -> Result {
    let mut trainer = trainer(1)?;
    trainer.cycle()?;
    if let Some(folder) = env::var_os(FULL) {
        match trainer.save(folder) {
            Err(CheckpointError::Write { .. }) => return Ok(()),
            saved => panic!("{saved:?}"),
        }
    }
    let folder = tempdir()?;
    let len = fs::metadata(trainer.save(folder.path())?)?.len();
    let last_block = (len - 1) / 512;
    for block in (0..12).map(|part| part * last_block / 11) {
        let folder = tempdir()?;
        // Files end at this block of 512 bytes.
        let limited = "trap '' XFSZ; ulimit -f $0; exec \"$@\"";
        let output = Command::new("sh")
            .args(["-c", limited, &block.to_string()])
            .arg(env::current_exe()?)
            .arg("a_full_disk_is_an_error_that_prints_nothing_and_leaves_nothing")
            .env(FULL, folder.path())
            .output()?;
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let stdout = text(&output.stdout);
        assert!(output.status.success() && stdout.contains("1 passed"), "block {block}: {stdout}");
        assert_eq!(text(&output.stderr), "", "block {block}");
        assert_eq!(fs::read_dir(folder.path())?.count(), 0);
    }
    Ok(())
}

#[test]
fn unfinished_checkpoints_of_the_run_are_removed_and_no_others() -> Result {
    let folder = tempdir()?;
    let mut run = trainer(1)?;
    let path = run.save(folder.path())?;
    let mut archive = zip::ZipArchive::new(fs::File::open(path)?)?;
    let state: serde_json::Value = serde_json::from_reader(archive.by_name("state.json")?)?;
    let run_id = state["run_id"].as_u64().ok_or("no run_id")?;
    let mark = format!("{run_id:016x}");
    let left = [
        format!(".checkpoint-000000000100.zip.{mark}"),
        format!("..checkpoint-000000000100.zip.{mark}.AbCdEf"),
    ];
    let others = [
        ".checkpoint-000000000100.zip.backup".to_owned(),
        format!(".checkpoint-000000000100.zip.{:016x}", run_id.wrapping_add(1)),
    ];
    for name in left.iter().chain(&others) {
        fs::write(folder.path().join(name), "half")?;
    }
    run.cycle()?;
    run.save(folder.path())?;
    let names = contents(folder.path())?;
    assert!(left.iter().all(|name| !names.contains_key(name.as_ref() as &std::ffi::OsStr)));
    assert!(others.iter().all(|name| names.contains_key(name.as_ref() as &std::ffi::OsStr)));
    assert_eq!(names.len(), 4, "{:?}", names.keys());
    Ok(())
}
