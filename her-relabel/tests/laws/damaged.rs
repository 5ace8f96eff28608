//! Rejected files, and hostile files, which do no harm.

use crate::common::Telling;
use crate::saving::{load, plain_step, saved, small};
use her_relabel::{Batch, GoalStrategy, HerBuffer, LoadError, Sampler, StartData, UnitInterval};
use proptest::prelude::*;

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
    for version in [1, 4, 9] {
        let mut other = bytes.clone();
        other[8] = version;
        let Err(LoadError::Version { version: found }) = load(&other) else {
            panic!("format {version} is read");
        };
        assert_eq!(found, u32::from(version));
    }
    let other = HerBuffer::<f32>::read_from(&bytes[..]).unwrap_err();
    assert!(matches!(other, LoadError::ElementSize { expected: 4, actual: 8 }));
    assert!(other.to_string().contains("HerBuffer<f64>"));
}

/// Gives a changed file the right checksum, as a hostile writer would.
pub(crate) fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let end = bytes.len() - 4;
    let checksum = crc32fast::hash(&bytes[..end]);
    bytes[end..].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

/// The places of the numbers in [`small`]'s file that are not elements: the sizes, the field, and
/// after it the settings of priorities and of motionless episodes, and at the end the priorities.
fn numbers(bytes: &[u8]) -> Vec<usize> {
    let field = 16 + 6 * 8;
    let after_name = field + 8 + "value".len();
    let head = (16..=field).step_by(8).chain((after_name..after_name + 14 * 8).step_by(8));
    let tail = (1..7).map(|back| bytes.len() - 4 - 8 * back);
    head.chain(tail).collect()
}

#[test]
fn hostile_numbers_with_the_right_checksum_are_refused_or_harmless() {
    let bytes = saved(&small());
    let mut refused = 0;
    for at in numbers(&bytes) {
        for shift in 0..64 {
            for number in [1_u64 << shift, (1_u64 << shift) - 1, !(1_u64 << shift)] {
                let mut changed = bytes.clone();
                changed[at..at + 8].copy_from_slice(&number.to_le_bytes());
                match load(&sealed(changed)) {
                    Ok(mut buffer) => use_it(&mut buffer),
                    Err(_) => refused += 1,
                }
            }
        }
    }
    assert!(refused > 2000, "{refused}");
}

proptest! {
    #[test]
    fn several_hostile_bytes_are_refused_or_harmless(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut bytes = saved(&small());
        for (index, byte) in changes {
            let at = index.index(bytes.len());
            bytes[at] = byte;
        }
        if let Ok(mut buffer) = load(&sealed(bytes)) {
            use_it(&mut buffer);
        }
    }
}

/// Uses a loaded buffer, which must work like any other.
fn use_it(buffer: &mut HerBuffer<f64>) {
    let beta = buffer.config().priorities().map(|_| UnitInterval::ONE);
    let sampler =
        Sampler::new(20, GoalStrategy::Random, UnitInterval::from_k(1)).with_priorities(beta);
    let mut batch = Batch::<f64>::new();
    for _ in 0..5 {
        let _may_have_nothing = sampler.sample(buffer, &Telling, 1, &mut batch);
        let _may_need_other_fields = buffer.add_step(0, &plain_step());
        let _may_be_recording_nothing = buffer.end_episode(0);
        let _may_have_other_sizes = buffer.begin_episode(
            0,
            &StartData {
                observation: &[0.0; 2],
                achieved_goal: &[0.0; 3],
                desired_goal: &[0.0; 3],
            },
        );
    }
}
