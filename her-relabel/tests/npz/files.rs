//! Files, and disks that fail.

use std::fs::File;
use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use goal_reward::DistanceReward;
use her_relabel::{GoalColumns, HerBuffer, NpzError};

use crate::common::{Result, config, drawn, exported, filled};

/// A disk with room for a number of bytes, which refuses everything from some call on.
struct Disk {
    contents: Cursor<Vec<u8>>,
    room: usize,
    calls: usize,
}

impl Disk {
    fn call(&mut self) -> io::Result<()> {
        self.calls = self.calls.checked_sub(1).ok_or(io::ErrorKind::TimedOut)?;
        Ok(())
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.call()?;
        let room = self.room.saturating_sub(self.contents.position() as usize);
        if room == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.contents.write(&bytes[..room.min(bytes.len())])
    }
    fn flush(&mut self) -> io::Result<()> {
        self.call()
    }
}

impl Seek for Disk {
    fn seek(&mut self, target: SeekFrom) -> io::Result<u64> {
        self.call()?;
        self.contents.seek(target)
    }
}

/// The process whose standard error the next test reads.
#[test]
#[ignore = "is run by another test"]
fn exports_to_disks_that_fail() {
    let buffer = filled::<f32>(50, 3);
    let export = |room, calls| {
        let mut disk = Disk { contents: Cursor::default(), room, calls };
        let result = buffer.write_npz(&mut disk);
        (result.map_err(|error| error.kind()), disk)
    };
    let (result, whole) = export(usize::MAX, usize::MAX);
    assert_eq!(result, Ok(()));
    let (size, calls) = (whole.contents.get_ref().len(), usize::MAX - whole.calls);
    for room in 0..size {
        assert_eq!(export(room, usize::MAX).0, Err(io::ErrorKind::StorageFull), "{room}");
    }
    for calls in 0..calls {
        assert_eq!(export(size, calls).0, Err(io::ErrorKind::TimedOut), "{calls}");
    }
    let (result, disk) = export(size, calls);
    assert_eq!((result, disk.contents), (Ok(()), whole.contents));
    if let Ok(full) = File::options().write(true).open("/dev/full") {
        let error = buffer.write_npz(full).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    }
}

#[test]
fn a_full_disk_is_an_error_and_nothing_is_printed() -> Result {
    let child = Command::new(std::env::current_exe()?)
        .args(["--exact", "files::exports_to_disks_that_fail", "--ignored"])
        .output()?;
    let [out, error] = [child.stdout, child.stderr].map(String::from_utf8);
    assert!(child.status.success(), "{}", out?);
    assert_eq!(error?, "");
    Ok(())
}

#[test]
fn a_file_is_written_whole_and_read_again() -> Result {
    let directory = tempfile::tempdir()?;
    let path = directory.path().join("episodes.npz");
    let buffer = filled::<f32>(50, 5);
    buffer.export_npz(&path)?;
    let mut same = HerBuffer::<f32>::new(config(50))?;
    assert_eq!(same.import_npz(&path)?, 5);
    assert_eq!(drawn(&same), drawn(&buffer));
    assert_eq!(std::fs::read_dir(directory.path())?.count(), 1);
    assert!(buffer.export_npz(directory.path().join("none").join("e.npz")).is_err());
    let missing = same.import_npz(directory.path().join("none.npz"));
    assert!(matches!(missing, Err(NpzError::Archive(_))));
    assert_eq!(same.len(), buffer.len());
    Ok(())
}

#[cfg(unix)]
#[test]
fn neither_a_pipe_nor_a_device_is_read() -> Result {
    let directory = tempfile::tempdir()?;
    let (pipe, zero) = (directory.path().join("pipe"), directory.path().join("zero"));
    assert!(Command::new("mkfifo").arg(&pipe).status()?.success());
    std::os::unix::fs::symlink("/dev/zero", &zero)?;
    let mut buffer = HerBuffer::<f32>::new(config(50))?;
    let goals = GoalColumns { array: "achieved_goals", width: 1, columns: 0..1, desired: None };
    for path in [&pipe, &zero] {
        let errors = [
            buffer.import_npz(path).unwrap_err().to_string(),
            buffer.import_ogbench(path, &goals, &DistanceReward::sparse()).unwrap_err().to_string(),
            HerBuffer::<f32>::load(path).unwrap_err().to_string(),
        ];
        for error in errors {
            assert!(error.contains("is not a regular file"), "{error}");
        }
    }
    Ok(())
}

/// Each import sees one of the two archives, never a mixture.
#[test]
fn a_file_that_is_replaced_while_it_is_read_is_one_or_the_other() -> Result {
    let directory = tempfile::tempdir()?;
    let path = directory.path().join("episodes.npz");
    let (one, other) = (filled::<f32>(100, 2), filled::<f32>(100, 5));
    one.export_npz(&path)?;
    let is_over = AtomicBool::new(false);
    thread::scope(|scope| {
        let writer = scope.spawn(|| -> io::Result<()> {
            while !is_over.load(Ordering::Relaxed) {
                other.export_npz(&path)?;
                one.export_npz(&path)?;
            }
            Ok(())
        });
        let read = || -> Result {
            for _ in 0..300 {
                let mut buffer = HerBuffer::<f32>::new(config(100))?;
                buffer.import_npz(&path)?;
                let bytes = exported(&buffer);
                assert!(bytes == exported(&one) || bytes == exported(&other));
            }
            Ok(())
        };
        let outcome = read();
        is_over.store(true, Ordering::Relaxed);
        writer.join().map_err(|_| "the writer panicked")??;
        outcome
    })
}
