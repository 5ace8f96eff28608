//! Checkpoints with contents that no run writes are rejected, or the run continues.

use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use baselines::learn::{CheckpointError, Trainer};
use safetensors::SafeTensors;
use serde_json::Value;
use tempfile::{TempDir, tempdir};
use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

use crate::runs::{Kinematic, Result, ddpg, make, sac, settings};
use testing::{Number, numbers, with_number_replaced};

pub(crate) type Entry = (String, Vec<u8>);

/// Returns the entries of a checkpoint.
pub(crate) fn entries(path: &Path) -> Result<Vec<Entry>> {
    let mut archive = ZipArchive::new(File::open(path)?)?;
    let mut entries = Vec::new();
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index)?;
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes)?;
        entries.push((entry.name()?.into_owned(), bytes));
    }
    Ok(entries)
}

/// The folder of a run, its checkpoint and the checkpoint's entries.
fn run(trainer: &mut Trainer<Kinematic>) -> Result<(TempDir, PathBuf, Vec<Entry>)> {
    let folder = tempdir()?;
    trainer.cycle()?;
    trainer.cycle()?;
    let path = trainer.save(folder.path())?;
    let entries = entries(&path)?;
    Ok((folder, path, entries))
}

/// Writes an archive of entries.
pub(crate) fn write(path: &Path, entries: &[Entry], method: CompressionMethod) -> Result {
    let mut archive = ZipWriter::new(File::create(path)?);
    for (name, bytes) in entries {
        archive.start_file(name, SimpleFileOptions::default().compression_method(method))?;
        archive.write_all(bytes)?;
    }
    archive.finish()?;
    Ok(())
}

/// Returns the entries with one of them changed.
fn with(entries: &[Entry], name: &str, bytes: Vec<u8>) -> Vec<Entry> {
    let mut entries = entries.to_vec();
    entries.iter_mut().filter(|entry| entry.0 == name).for_each(|entry| entry.1.clone_from(&bytes));
    entries
}

fn resume(folder: &TempDir) -> Result<Trainer<Kinematic>, CheckpointError> {
    Trainer::resume(make, folder.path(), 1)
}

#[test]
fn a_tensor_with_a_number_that_no_run_has_is_named() -> Result {
    for algorithm in [ddpg(), sac()] {
        let (folder, path, entries) = run(&mut Trainer::new(make, settings(algorithm), 0, 1)?)?;
        let (name, bytes) =
            entries.iter().find(|(name, _)| name.ends_with(".safetensors")).ok_or("no networks")?;
        let tensors = SafeTensors::deserialize(bytes)?;
        let start = bytes.len() - tensors.iter().map(|(_, view)| view.data().len()).sum::<usize>();
        for (tensor, view) in tensors.iter() {
            let offset = view.data().as_ptr() as usize - bytes.as_ptr() as usize;
            assert!(offset >= start);
            let is_square = tensor.ends_with("second_moment");
            let squares = is_square.then_some(-1.0_f32);
            for wrong in [f32::NAN, f32::INFINITY].into_iter().chain(squares) {
                let mut bytes = bytes.clone();
                let last = offset + view.data().len() - 4;
                bytes[last..last + 4].copy_from_slice(&wrong.to_le_bytes());
                write(&path, &with(&entries, name, bytes), CompressionMethod::Stored)?;
                match resume(&folder) {
                    Err(CheckpointError::Damaged { reason, .. }) => {
                        assert!(
                            reason.contains(&format!("the tensor {tensor} has {wrong}")),
                            "{reason}"
                        );
                    }
                    other => panic!("{tensor}: {other:?}"),
                }
            }
        }
    }
    Ok(())
}

#[test]
fn numbers_that_no_run_has_are_refused_or_the_run_goes_on() -> Result {
    let mut settings = settings(ddpg());
    settings.schedule.num_envs = 1;
    settings.schedule.updates_per_cycle = 1;
    let (folder, path, entries) = run(&mut Trainer::new(make, settings, 0, 1)?)?;
    let (mut refused, mut resumed) = (0, 0);
    for (name, bytes) in entries.iter().filter(|(name, _)| name.ends_with(".json")) {
        let value: Value = serde_json::from_slice(bytes)?;
        for number in numbers(&value) {
            let wrong = [Number::Integer(u64::MAX), Number::Float(1e308)];
            for wrong in &wrong[usize::from(number.is_f64())..] {
                let changed: Value = with_number_replaced(&value, number, *wrong)?;
                let bytes = serde_json::to_vec(&changed)?;
                write(&path, &with(&entries, name, bytes), CompressionMethod::Stored)?;
                match resume(&folder) {
                    Err(_) => refused += 1,
                    Ok(mut trainer) => {
                        resumed += 1;
                        // It may diverge, and does not panic.
                        let _ = trainer.cycle().map(|()| trainer.evaluate());
                    }
                }
            }
        }
    }
    assert!(refused > 50 && resumed > 5, "{refused} {resumed}");
    Ok(())
}

#[test]
fn settings_out_of_range_are_damage() -> Result {
    let (folder, path, entries) = run(&mut Trainer::new(make, settings(ddpg()), 0, 1)?)?;
    let (name, bytes) = entries.iter().find(|(name, _)| name == "state.json").ok_or("no state")?;
    let mut state: Value = serde_json::from_slice(bytes)?;
    state["settings"]["replay"]["batch_size"] = u64::MAX.into();
    write(&path, &with(&entries, name, serde_json::to_vec(&state)?), CompressionMethod::Stored)?;
    match resume(&folder) {
        Err(CheckpointError::Damaged { path: named, reason, .. }) => {
            assert!(reason.contains("batch_size is 18446744073709551615"), "{reason}");
            assert_eq!(named, path);
        }
        other => panic!("{other:?}"),
    }
    Ok(())
}

/// A few bytes of a file could otherwise fill the memory.
#[test]
fn compressed_checkpoints_are_refused() -> Result {
    let (folder, path, entries) = run(&mut Trainer::new(make, settings(ddpg()), 0, 1)?)?;
    write(&path, &entries, CompressionMethod::Stored)?;
    resume(&folder)?;
    write(&path, &entries, CompressionMethod::Deflated)?;
    assert!(fs::metadata(&path)?.len() > 0);
    match resume(&folder) {
        Err(CheckpointError::Damaged { reason, .. }) => {
            assert!(reason.contains("is compressed"), "{reason}");
        }
        other => panic!("{other:?}"),
    }
    Ok(())
}
