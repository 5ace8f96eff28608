//! Files that are almost valid.

use arbitrary::Arbitrary;
use her_relabel::{
    BufferConfig, HerBuffer, MotionlessEpisodes, NewPriority, Priorities, PriorityUnit, Scalar,
    UnitInterval,
};

use crate::common::{DIMS, add_whole, begin, step};

/// A buffer with every feature.
pub fn template<T: Scalar>() -> HerBuffer<T> {
    let config = BufferConfig::new(8, DIMS)
        .with_num_envs(2)
        .with_field("value", 1)
        .with_priorities(
            Priorities::new(PriorityUnit::Episode).with_new_priority(NewPriority::Given(0.5)),
        )
        .with_motionless_episodes(MotionlessEpisodes::new(0.5, UnitInterval::ZERO));
    let mut buffer = HerBuffer::new(config).expect("a buffer");
    for number in [1, 2, 3] {
        add_whole(&mut buffer, number, 3);
    }
    begin(&mut buffer, 1, 4).expect("an episode");
    step(&mut buffer, 1, 4, 0, false).expect("a step");
    buffer
}

/// A file: any bytes, or a valid file with some changes.
#[derive(Arbitrary, Debug)]
pub enum Input {
    Bytes(Vec<u8>),
    Changes(Vec<(u16, u8)>),
    /// Replaced numbers, by their distance from the start or the end.
    Numbers(Vec<(i16, u64)>),
}

impl Input {
    /// Returns the file, given a valid one.
    pub fn apply(self, mut bytes: Vec<u8>) -> Vec<u8> {
        let len = bytes.len();
        match self {
            Self::Bytes(bytes) => return bytes,
            Self::Changes(changes) => {
                changes.into_iter().for_each(|(at, byte)| bytes[usize::from(at) % len] = byte);
            }
            Self::Numbers(numbers) => {
                for (at, number) in numbers {
                    let at = isize::from(at).rem_euclid(len as isize) as usize;
                    let end = len.min(at + 8);
                    bytes[at..end].copy_from_slice(&number.to_le_bytes()[..end - at]);
                }
            }
        }
        bytes
    }
}
