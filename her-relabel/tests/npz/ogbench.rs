//! Trajectories of OGBench.

use std::io::{Cursor, Write};

use goal_reward::DistanceReward;
use her_relabel::{BufferConfig, Dims, GoalColumns, HerBuffer, NpzError};
use proptest::prelude::*;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::arrays::plain;
use crate::common::{Result, exported};

const DIMS: Dims = Dims { observation: 3, goal: 2, action: 1 };
/// The first two columns of an observation are the goal, as a position is in a maze.
const GOALS: GoalColumns<'_> =
    GoalColumns { array: "observations", width: 3, columns: 0..2, desired: None };

/// An archive with trajectories of these numbers of states, whose row `i` observes `i`, `i + 0.25`
/// and `i + 0.5`.
fn archive(lengths: &[usize], compression: CompressionMethod) -> Vec<u8> {
    let rows: usize = lengths.iter().sum();
    let floats =
        |numbers: Vec<f32>| -> Vec<u8> { numbers.into_iter().flat_map(f32::to_le_bytes).collect() };
    let observations = (0..rows).flat_map(|row| [0.0, 0.25, 0.5].map(|part| row as f32 + part));
    let ends = lengths.iter().flat_map(|len| (1..=*len).map(move |at| u8::from(at == *len)));
    let arrays = [
        ("observations", plain("<f4", &format!("{rows}, 3"), &floats(observations.collect()))),
        ("actions", plain("<f4", &format!("{rows}, 1"), &floats(vec![0.5; rows]))),
        ("terminals", plain("|b1", &format!("{rows},"), &ends.collect::<Vec<_>>())),
    ];
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(compression);
    for (name, array) in arrays {
        writer.start_file(format!("{name}.npy"), options).unwrap();
        writer.write_all(&array).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

fn buffer(capacity: usize) -> HerBuffer<f64> {
    HerBuffer::new(BufferConfig::new(capacity, DIMS)).unwrap()
}

fn refusal(bytes: &[u8], goals: &GoalColumns<'_>) -> Option<NpzError> {
    let mut buffer = buffer(20);
    let reward = DistanceReward::sparse();
    buffer
        .import_ogbench_bytes(&archive(&[3], CompressionMethod::Stored), &GOALS, &reward)
        .unwrap();
    let before = exported(&buffer);
    let error = buffer.import_ogbench_bytes(bytes, goals, &reward).err();
    if error.is_some() {
        assert!(exported(&buffer) == before, "an error changes nothing");
    }
    error
}

#[test]
fn trajectories_become_episodes_towards_their_last_states() -> Result {
    for compression in [CompressionMethod::Stored, CompressionMethod::Deflated] {
        let mut imported = buffer(20);
        let bytes = archive(&[3, 1, 5], compression);
        let reward = DistanceReward::dense();
        assert_eq!(imported.import_ogbench_bytes(&bytes, &GOALS, &reward)?, 2);
        assert_eq!((imported.num_episodes(), imported.len()), (2, 6));
        let mut expected = buffer(20);
        for (first, len) in [(0, 3), (4, 5)] {
            let states = (first..first + len).map(f64::from);
            let goal = |row: f64| [row, row + 0.25];
            let last = f64::from(first + len - 1);
            let distance = |row: f64| -(2.0 * (last - row).powi(2)).sqrt();
            expected.add_episode(&her_relabel::EpisodeData {
                observation: &states
                    .clone()
                    .flat_map(|s| [s, s + 0.25, s + 0.5])
                    .collect::<Vec<_>>(),
                achieved_goal: &states.clone().flat_map(goal).collect::<Vec<_>>(),
                desired_goal: &goal(last),
                action: &vec![0.5; len as usize - 1],
                reward: &states.skip(1).map(distance).collect::<Vec<_>>(),
                terminated: false,
                truncated: true,
                fields: &[],
            })?;
        }
        assert!(exported(&imported) == exported(&expected));
    }
    Ok(())
}

#[test]
fn of_a_trajectory_longer_than_the_buffer_the_end_stays() -> Result {
    let mut buffer = buffer(4);
    let bytes = archive(&[200], CompressionMethod::Deflated);
    buffer.import_ogbench_bytes(&bytes, &GOALS, &DistanceReward::sparse())?;
    assert_eq!((buffer.num_episodes(), buffer.len()), (1, 4));
    Ok(())
}

#[test]
fn what_is_no_archive_of_trajectories_is_refused() {
    let bytes = archive(&[3, 4], CompressionMethod::Stored);
    assert!(refusal(&bytes, &GOALS).is_none());
    let goals = |columns, width| GoalColumns { columns, width, ..GOALS };
    let reversed = std::ops::Range { start: 3, end: 1 };
    for goals in [goals(0..1, 3), goals(2..4, 3), goals(0..0, 0), goals(reversed, 3)] {
        let error = refusal(&bytes, &goals);
        assert!(matches!(error, Some(NpzError::Columns { .. })), "{error:?}");
    }
    let error = refusal(&bytes, &goals(0..2, 4));
    assert!(matches!(error, Some(NpzError::Shape { .. })), "{error:?}");
    let missing = GoalColumns { desired: Some("desired_goals"), ..GOALS };
    let error = refusal(&bytes, &missing);
    assert!(matches!(error, Some(NpzError::Missing { .. })), "{error:?}");
    // The last byte of `terminals` is before the central directory.
    let end = bytes.windows(4).position(|window| window == b"PK\x01\x02").unwrap();
    let mut unended = bytes;
    unended[end - 1] = 0;
    assert!(refusal(&unended, &GOALS).is_some());
}

#[test]
fn a_trajectory_without_an_end_is_refused() {
    let rows = 3;
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let arrays = [
        ("observations", plain("<f4", "3, 3", &[0; 36])),
        ("actions", plain("<f4", "3, 1", &[0; 12])),
        ("terminals", plain("|b1", "3,", &[0, 1, 0])),
    ];
    for (name, array) in arrays {
        writer.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
        writer.write_all(&array).unwrap();
    }
    let bytes = writer.finish().unwrap().into_inner();
    let error = refusal(&bytes, &GOALS);
    assert!(matches!(error, Some(NpzError::Unended { row }) if row + 1 == rows), "{error:?}");
}

proptest! {
    #[test]
    fn damaged_archives_are_refused_or_read(
        at in any::<prop::sample::Index>(),
        byte in any::<u8>(),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = archive(&[3, 4], CompressionMethod::Deflated);
        let place = at.index(bytes.len());
        bytes[place] ^= byte;
        refusal(&bytes, &GOALS);
        bytes.truncate(cut.index(bytes.len()));
        refusal(&bytes, &GOALS);
    }
}
