//! A loaded buffer is the saved one, and nothing else can be loaded.

use std::fs;
use std::io::{self, Write};

use crate::common::{DIMS, Telling, add, begin, buffer, rows, step};
use her_relabel::{Batch, BufferConfig, GoalStrategy, HerBuffer, LoadError, RelabelRatio, Sampler};
use proptest::prelude::*;

fn saved(buffer: &HerBuffer<f64>) -> Vec<u8> {
    let mut bytes = Vec::new();
    buffer.write_to(&mut bytes).unwrap();
    bytes
}

fn load(bytes: &[u8]) -> Result<HerBuffer<f64>, LoadError> {
    HerBuffer::read_from(bytes)
}

/// Adds to the buffer: step `at` of all that happens.
fn happen(buffer: &mut HerBuffer<f64>, at: u32, (env, len, ends): (usize, u32, bool)) {
    match len {
        0..4 => add(buffer, at, len + 1, (ends, true)),
        4 if at.is_multiple_of(7) => buffer.clear(),
        _ => {
            let t = match buffer.unfinished_steps(env).unwrap() {
                Some(steps) => steps as u32,
                None => {
                    begin(buffer, env, env as u32 + 900).unwrap();
                    0
                }
            };
            // The steps of a longer episode could not be counted by what is kept of it.
            let ends = ends || t as usize + 1 == buffer.config().capacity;
            step(buffer, env, env as u32 + 900, t, (false, ends)).unwrap();
        }
    }
}

fn assert_same(one: &HerBuffer<f64>, other: &HerBuffer<f64>) {
    assert_eq!(one.config(), other.config());
    assert_eq!(one.transition_ids(), other.transition_ids());
    assert_eq!(one.n_episodes(), other.n_episodes());
    let sampler = Sampler::new(200, GoalStrategy::Random, RelabelRatio::from_k(1));
    let mut batches = [Batch::new(), Batch::new()];
    let [a, b] = [one, other].map(|buffer| {
        let [batch, _] = &mut batches;
        let drawn = sampler.sample_seeded(buffer, &Telling, 9, batch);
        drawn.map(|()| batch.clone())
    });
    if let Ok(batch) = &a {
        rows(batch);
    }
    assert_eq!(a, b);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_loaded_buffer_goes_on_as_the_saved_one(
        capacity in prop_oneof![3_usize..12, 60_usize..70, Just(130)],
        before in prop::collection::vec((0_usize..2, 0_u32..9, any::<bool>()), 0..90),
        after in prop::collection::vec((0_usize..2, 0_u32..9, any::<bool>()), 0..90),
    ) {
        let config = BufferConfig::new(capacity, DIMS).with_n_envs(2);
        let mut buffer = HerBuffer::<f64>::new(config).unwrap();
        for (at, event) in before.into_iter().enumerate() {
            happen(&mut buffer, at as u32, event);
        }
        let mut loaded = load(&saved(&buffer)).unwrap();
        assert_same(&buffer, &loaded);
        for (at, event) in after.into_iter().enumerate() {
            happen(&mut buffer, at as u32, event);
            happen(&mut loaded, at as u32, event);
        }
        assert_same(&buffer, &loaded);
        prop_assert_eq!(saved(&buffer), saved(&loaded));
    }
}

fn small() -> HerBuffer<f64> {
    let mut buffer = buffer(8);
    for episode in 0..4 {
        add(&mut buffer, episode, 3, (false, true));
    }
    begin(&mut buffer, 0, 7).unwrap();
    step(&mut buffer, 0, 7, 0, (false, false)).unwrap();
    buffer
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    let bytes = saved(&small());
    for len in 0..bytes.len() {
        assert!(matches!(load(&bytes[..len]), Err(LoadError::Truncated)), "{len} bytes");
    }
    let longer = [&bytes[..], &[0]].concat();
    assert!(matches!(load(&longer), Err(LoadError::Damaged)));
}

#[test]
fn every_changed_bit_is_noticed() {
    let bytes = saved(&small());
    for at in 0..bytes.len() {
        for bit in [0, at % 8, 7] {
            let mut changed = bytes.clone();
            changed[at] ^= 1 << bit;
            assert!(load(&changed).is_err(), "bit {bit} of byte {at}");
        }
    }
}

#[test]
fn foreign_files_say_what_they_are() {
    let bytes = saved(&small());
    assert!(matches!(load(b"PK\x03\x04 and so on"), Err(LoadError::Foreign)));
    let mut newer = bytes.clone();
    newer[8] = 9;
    assert!(matches!(load(&newer), Err(LoadError::Version { version: 9 })));
    let other = HerBuffer::<f32>::read_from(&bytes[..]).unwrap_err();
    assert!(matches!(other, LoadError::ElementSize { expected: 4, actual: 8 }));
    assert!(other.to_string().contains("HerBuffer<f64>"));
}

proptest! {
    /// The sizes are the ten numbers after the first 16 bytes, and the unfinished episode comes last.
    #[test]
    fn a_hostile_file_asks_for_no_memory(
        sizes in prop::collection::vec((0_usize..10, 0_u32..64), 1..4),
        recorder in any::<u64>(),
    ) {
        let mut bytes = saved(&small());
        for (at, shift) in sizes {
            bytes[16 + 8 * at..][..8].copy_from_slice(&(1_u64 << shift).to_le_bytes());
        }
        let at = bytes.len() - 4 - 8 * (1 + 2 * 8 + 3);
        bytes[at..at + 8].copy_from_slice(&recorder.to_le_bytes());
        prop_assert!(load(&bytes).is_err());
    }
}

#[test]
fn saving_replaces_the_file_whole_or_not_at_all() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("replay.her");
    small().save(&path).unwrap();
    assert_same(&HerBuffer::load(&path).unwrap(), &small());
    let mut later = small();
    add(&mut later, 9, 2, (true, false));
    later.save(&path).unwrap();
    assert_same(&HerBuffer::load(&path).unwrap(), &later);
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1, "nothing is left over");
    assert!(later.save(directory.path().join("missing").join("replay.her")).is_err());
    // A directory cannot be replaced by a file: the last step fails, after everything was written.
    let taken = directory.path().join("taken");
    fs::create_dir(&taken).unwrap();
    assert!(later.save(&taken).is_err());
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 2);
    let missing = HerBuffer::<f64>::load(directory.path().join("none")).unwrap_err();
    assert!(matches!(missing, LoadError::Io(_)));
}

/// A disk with room for so many bytes.
struct Disk(usize);

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = bytes.len().min(self.0);
        self.0 -= count;
        Ok(count)
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_full_disk_is_an_error() {
    let size = saved(&small()).len();
    assert!(small().write_to(Disk(size)).is_ok());
    for room in [0, 10, size / 2, size - 1] {
        assert!(small().write_to(Disk(room)).is_err());
    }
}
