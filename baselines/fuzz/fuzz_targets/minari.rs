//! Importing any episode of Minari gives episodes that can be sampled, or an error that changes
//! nothing.
#![no_main]

use std::fs;
use std::sync::LazyLock;

use arbitrary::Arbitrary;
use baselines::datasets::import_minari;
use goal_reward::DistanceReward;
use her_relabel::{
    Batch, BufferConfig, Dims, GoalStrategy, HerBuffer, SampleError, Sampler, UnitInterval,
};
use libfuzzer_sys::fuzz_target;
use tempfile::{TempDir, tempdir};

/// An episode that Minari has written.
const GOOD: &[u8] = include_bytes!("../../tests/datasets/by_minari/data/1/part-0.arrow");
const DIMS: Dims = Dims { observation: 2, goal: 1, action: 1 };

/// The data set, of which each input replaces the second episode.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempdir().expect("a folder");
    for episode in ["0", "1"] {
        let path = folder.path().join("data").join(episode);
        fs::create_dir_all(&path).expect("a folder");
        fs::write(path.join("part-0.arrow"), GOOD).expect("a file");
    }
    let metadata = r#"{"total_episodes": 2, "data_format": "arrow"}"#;
    fs::write(folder.path().join("data/metadata.json"), metadata).expect("a file");
    folder
});

/// A file: any bytes, or the valid one with some changes.
#[derive(Arbitrary, Debug)]
enum Input {
    Bytes(Vec<u8>),
    Changes(Vec<(u16, u8)>),
    /// Replaced numbers of 32 and 64 bits.
    Words(Vec<(u16, i32)>, Vec<(u16, i64)>),
    Cut(u16),
}

impl Input {
    fn file(self) -> Vec<u8> {
        let mut bytes = GOOD.to_vec();
        let mut replace = |at: u16, word: &[u8]| {
            let place = usize::from(at) % (GOOD.len() - word.len());
            bytes[place..place + word.len()].copy_from_slice(word);
        };
        match self {
            Self::Bytes(bytes) => return bytes,
            Self::Changes(changes) => {
                changes.into_iter().for_each(|(at, byte)| replace(at, &[byte]));
            }
            Self::Words(short, long) => {
                short.into_iter().for_each(|(at, word)| replace(at, &word.to_le_bytes()));
                long.into_iter().for_each(|(at, word)| replace(at, &word.to_le_bytes()));
            }
            Self::Cut(len) => bytes.truncate(len.into()),
        }
        bytes
    }
}

fn draw(buffer: &HerBuffer<f32>) -> Result<Batch<f32>, SampleError> {
    let sampler = Sampler::new(40, GoalStrategy::Random, UnitInterval::from_k(1));
    let mut batch = Batch::new();
    sampler.sample(buffer, &DistanceReward::sparse(), 7, &mut batch).map(|()| batch)
}

fuzz_target!(|input: Input| {
    let path = FOLDER.path().join("data/1/part-0.arrow");
    let mut buffer = HerBuffer::<f32>::new(BufferConfig::new(20, DIMS)).expect("a buffer");
    fs::write(&path, GOOD).expect("a file");
    assert_eq!(import_minari(&mut buffer, FOLDER.path()).ok(), Some(4));
    let before = (draw(&buffer), buffer.transition_ids());
    fs::write(&path, input.file()).expect("a file");
    match import_minari(&mut buffer, FOLDER.path()) {
        Ok(_) => drop(draw(&buffer)),
        Err(_) => assert_eq!(before, (draw(&buffer), buffer.transition_ids())),
    }
});
