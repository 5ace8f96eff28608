//! Exchanging episodes with numpy.
#![cfg(feature = "npz")]
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom, Write};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use goal_reward::DistanceReward;
use her_relabel::{
    Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer, NpzError, Priorities,
    PriorityUnit, Sampler, Scalar, TransitionId, UnitInterval,
};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const DIMS: Dims = Dims { observation: 2, goal: 1, action: 1 };

fn config(capacity: usize) -> BufferConfig {
    BufferConfig::new(capacity, DIMS).with_field("log_prob", 1).with_field("latent", 2)
}

/// Episode `episode` has `episode + 1` steps.
fn add<T: Scalar>(buffer: &mut HerBuffer<T>, episode: u8) {
    let steps = usize::from(episode) + 1;
    let numbers = |count: usize, offset: f64| -> Vec<f64> {
        (0..count).map(|at| f64::from(episode) + at as f64 / 16.0 + offset).collect()
    };
    let data = EpisodeData {
        observation: &numbers(2 * (steps + 1), 0.0),
        achieved_goal: &numbers(steps + 1, 100.0),
        desired_goal: &[200.0 + f64::from(episode)],
        action: &numbers(steps, 300.0),
        reward: &numbers(steps, 400.0),
        terminated: episode.is_multiple_of(2),
        truncated: !episode.is_multiple_of(3) || !episode.is_multiple_of(2),
        fields: &[("latent", &numbers(2 * steps, 500.0)), ("log_prob", &numbers(steps, 600.0))],
    };
    buffer.add_episode(&data).unwrap();
}

fn filled<T: Scalar>(capacity: usize, episodes: u8) -> HerBuffer<T> {
    let mut buffer = HerBuffer::new(config(capacity)).unwrap();
    (0..episodes).for_each(|episode| add(&mut buffer, episode));
    buffer
}

fn exported<T: Scalar>(buffer: &HerBuffer<T>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    buffer.write_npz(&mut bytes).unwrap();
    bytes.into_inner()
}

/// Everything in a batch except the numbers of its transitions, which differ in another buffer.
fn drawn<T: Scalar>(buffer: &HerBuffer<T>) -> Vec<f64> {
    let sampler = Sampler::new(300, GoalStrategy::Random, UnitInterval::from_k(1));
    let mut batch = Batch::<T>::new();
    sampler.sample(buffer, &DistanceReward::dense(), 5, &mut batch).unwrap();
    let columns = [
        batch.observation(),
        batch.achieved_goal(),
        batch.desired_goal(),
        batch.action(),
        batch.reward(),
        batch.next_observation(),
        batch.next_achieved_goal(),
        batch.field("log_prob").unwrap(),
        batch.field("latent").unwrap(),
    ];
    let flags = batch.terminated().iter().chain(batch.truncated());
    let numbers = columns.into_iter().flatten().map(|number| number.to_f64());
    numbers.chain(flags.map(|flag| f64::from(*flag))).collect()
}

#[test]
fn imported_episodes_are_the_exported_ones() -> Result {
    // A whole buffer, and the rest of a ring that has wrapped.
    for capacity in [100, 33] {
        let buffer = filled::<f32>(capacity, 12);
        let bytes = exported(&buffer);
        let mut same = HerBuffer::<f32>::new(config(capacity))?;
        let count = same.import_npz_bytes(&bytes)?;
        assert_eq!(count, buffer.num_episodes() as u64);
        assert_eq!((same.len(), same.num_episodes()), (buffer.len(), buffer.num_episodes()));
        assert_eq!(drawn(&same), drawn(&buffer));
        // These numbers are exact in both types.
        let mut wider = HerBuffer::<f64>::new(config(capacity))?;
        wider.import_npz_bytes(&bytes)?;
        assert_eq!(drawn(&wider), drawn(&buffer));
        assert_eq!(exported(&filled::<f64>(capacity, 12)), exported(&wider));
    }
    Ok(())
}

#[test]
fn episodes_are_added_to_what_is_there_and_the_newest_are_kept() -> Result {
    let archive = exported(&filled::<f64>(1000, 9));
    for capacity in [4, 20, 45, 60] {
        let mut imported = HerBuffer::<f64>::new(config(capacity))?;
        let mut added = HerBuffer::<f64>::new(config(capacity))?;
        add(&mut imported, 10);
        add(&mut added, 10);
        imported.import_npz_bytes(&archive)?;
        (0..9).for_each(|episode| add(&mut added, episode));
        assert_eq!(drawn(&imported), drawn(&added));
    }
    Ok(())
}

/// A disk with room for so many bytes, which refuses everything from some call on.
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
        .args(["--exact", "exports_to_disks_that_fail", "--ignored"])
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

#[test]
fn priorities_stay_and_imported_transitions_get_that_of_new_ones() -> Result {
    let priorities = Priorities::new(PriorityUnit::Transition);
    let mut buffer = HerBuffer::<f64>::new(config(100).with_priorities(priorities))?;
    add(&mut buffer, 1);
    let (oldest, newest) = buffer.transition_ids().ok_or("it is empty")?;
    buffer.set_priorities(&[oldest, newest], &[0.25, 5.0])?;
    buffer.import_npz_bytes(&exported(&filled::<f64>(100, 2)))?;
    let ids = (oldest.get()..).take(buffer.len()).filter_map(TransitionId::new);
    let found: Vec<Option<f64>> = ids.map(|id| buffer.priority(id)).collect();
    assert_eq!(found, [0.25, 5.0, 5.0, 5.0, 5.0].map(Some));
    Ok(())
}

#[test]
fn an_empty_buffer_is_an_archive_of_no_episodes() -> Result {
    let empty = exported(&filled::<f64>(50, 0));
    let mut buffer = filled::<f64>(50, 2);
    assert_eq!(buffer.import_npz_bytes(&empty)?, 0);
    assert_eq!(buffer.num_episodes(), 2);
    Ok(())
}

/// Written by numpy 2.4: `numpy.savez_compressed` of two episodes of two and one steps, with
/// integers of 64 bits and floats of 32 and 64 bits mixed, and an unrelated array.
#[test]
fn what_numpy_compressed_is_read() -> Result {
    let mut buffer = HerBuffer::<f32>::new(config(50))?;
    let archive = include_bytes!("data/numpy.npz");
    assert_eq!(buffer.import_npz_bytes(archive)?, 2);
    let mut expected = HerBuffer::<f32>::new(config(50))?;
    for (observations, actions, latent, terminated) in [
        (&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0][..], &[0.5, 1.5][..], &[0.0, 1.0, 2.0, 3.0][..], false),
        (&[6.0, 7.0, 8.0, 9.0], &[2.5], &[4.0, 5.0], true),
    ] {
        let data = EpisodeData {
            observation: observations,
            achieved_goal: &observations[..observations.len() / 2],
            desired_goal: &[if terminated { 20.0 } else { 10.0 }],
            action: actions,
            reward: &vec![-1.0; actions.len()],
            terminated,
            truncated: !terminated,
            fields: &[("log_prob", actions), ("latent", latent)],
        };
        expected.add_episode(&data)?;
    }
    assert_eq!(drawn(&buffer), drawn(&expected));
    Ok(())
}

/// An archive with some arrays replaced or left out.
fn changed(replaced: &[(&str, Option<Vec<u8>>)]) -> Vec<u8> {
    let bytes = exported(&filled::<f64>(50, 3));
    let mut archive = ZipArchive::new(Cursor::new(&bytes)).unwrap();
    let mut arrays = BTreeMap::new();
    for at in 0..archive.len() {
        let mut file = archive.by_index(at).unwrap();
        let mut array = Vec::new();
        file.read_to_end(&mut array).unwrap();
        arrays.insert(file.name().unwrap().trim_end_matches(".npy").to_owned(), Some(array));
    }
    for (name, array) in replaced {
        arrays.insert((*name).to_owned(), array.clone());
    }
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, array) in arrays {
        if let Some(array) = array {
            writer.start_file(format!("{name}.npy"), options).unwrap();
            writer.write_all(&array).unwrap();
        }
    }
    writer.finish().unwrap().into_inner()
}

/// An array with any header.
fn array(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
    let len = u32::try_from(header.len()).unwrap().to_le_bytes();
    let len = if version == 1 { &len[..2] } else { &len[..] };
    [b"\x93NUMPY", &[version, 0][..], len, header.as_bytes(), data].concat()
}

fn plain(dtype: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}\n");
    array(1, &header, data)
}

/// Imports into a buffer that is not empty, and checks that an error changes nothing.
fn refusal(bytes: &[u8]) -> Option<NpzError> {
    let mut buffer = filled::<f64>(50, 2);
    let before = (buffer.transition_ids(), buffer.num_episodes());
    let result = buffer.import_npz_bytes(bytes);
    let error = result.err();
    if error.is_some() {
        // Numbers of transitions are never reused.
        assert_eq!((buffer.transition_ids(), buffer.num_episodes()), before);
    }
    error
}

#[test]
fn a_foreign_or_damaged_archive_is_refused() -> Result {
    assert!(refusal(&changed(&[])).is_none());
    let bytes = exported(&filled::<f64>(50, 1));
    for len in (0..bytes.len()).step_by(11) {
        assert!(refusal(&bytes[..len]).is_some(), "{len} bytes");
    }
    let mut unharmed = 0;
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x11;
        let mut buffer = HerBuffer::<f64>::new(config(50))?;
        if buffer.import_npz_bytes(&damaged).is_ok() {
            // A time or an attribute of the archive; the episodes are the same.
            assert_eq!(exported(&buffer), bytes, "byte {at}");
            unharmed += 1;
        }
    }
    assert!(unharmed < bytes.len() / 2, "{unharmed} of {}", bytes.len());
    assert!(matches!(refusal(b"not an archive"), Some(NpzError::Archive(_))));
    Ok(())
}

#[test]
fn arrays_that_do_not_fit_are_named() -> Result {
    let error = |name: &'static str, array| refusal(&changed(&[(name, array)])).unwrap();
    let missing = error("actions", None);
    assert!(matches!(&missing, NpzError::Missing { array } if array == "actions"));
    let missing = error("fields_latent", None);
    assert!(missing.to_string().contains("`fields_latent`"));
    let typed = error("rewards", Some(plain("<i8", "6,", &[0; 48])));
    assert!(matches!(&typed, NpzError::Type { actual, .. } if actual == "'<i8'"), "{typed}");
    let typed = error("terminated", Some(plain("<f8", "3,", &[0; 24])));
    assert!(matches!(typed, NpzError::Type { expected: "bool", .. }), "{typed}");
    let shape = error("observations", Some(plain("<f8", "9, 3", &[0; 216])));
    assert!(matches!(shape, NpzError::Shape { rows: 9, width: 2, .. }), "{shape}");
    let shape = error("truncated", Some(plain("|b1", "2,", &[0; 2])));
    assert!(matches!(shape, NpzError::Shape { rows: 3, width: 1, .. }), "{shape}");
    let short = error("actions", Some(plain("<f8", "6, 1", &[0; 40])));
    assert!(matches!(&short, NpzError::Array { array, .. } if array == "actions"), "{short}");
    let long = error("actions", Some(plain("<f8", "6, 1", &[0; 49])));
    assert!(matches!(&long, NpzError::Array { .. }), "{long}");
    let nan = f64::NAN.to_le_bytes().repeat(6);
    let nan = error("actions", Some(plain("<f8", "6, 1", &nan)));
    assert!(matches!(nan, NpzError::Episode { episode: 0, .. }), "{nan}");
    let huge = 1e30_f64.to_le_bytes().repeat(6);
    let huge = error("rewards", Some(plain("<f8", "6,", &huge)));
    assert!(matches!(huge, NpzError::Episode { episode: 0, .. }), "{huge}");
    let lengths = |lengths: [i64; 3]| lengths.map(i64::to_le_bytes).concat();
    for wrong in [[1, 2, 4], [1, 0, 5], [-1, 3, 4], [1, 2, 2], [i64::MAX, 1, 1]] {
        let wrong = error("episode_lengths", Some(plain("<i8", "3,", &lengths(wrong))));
        assert!(matches!(wrong, NpzError::Lengths { expected: 6, .. }), "{wrong}");
    }
    let other = plain("<i8", "3,", &lengths([3, 2, 1]));
    assert!(refusal(&changed(&[("episode_lengths", Some(other))])).is_none());
    Ok(())
}

#[test]
fn every_form_that_numpy_writes_is_read() -> Result {
    let lengths = [1_i32, 2, 3].map(i32::to_le_bytes).concat();
    let numbers = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(f64::to_le_bytes).concat();
    let fortran = |shape: &str| {
        let header = format!("{{'descr': '<f8', 'fortran_order': True, 'shape': ({shape}), }}\n");
        array(1, &header, &numbers)
    };
    let padded = |len: usize| {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (6, 1), }";
        array(1, &format!("{header:<width$}\n", width = len - 1), &numbers)
    };
    let with_dimensions =
        |count: usize| plain("<f8", &format!("6{}", ", 1".repeat(count)), &numbers);
    let second = "{'descr': '<f8', 'fortran_order': False, 'shape': (6, 1), }\n";
    for (name, array) in [
        ("episode_lengths", plain("<i4", "3,", &lengths)),
        // One dimension has no order.
        ("rewards", fortran("6,")),
        ("actions", array(2, second, &numbers)),
        ("actions", array(3, second, &numbers)),
        ("actions", padded(1024)),
        // A header of 19 digits.
        ("actions", with_dimensions(17)),
    ] {
        let error = refusal(&changed(&[(name, Some(array))]));
        assert!(error.is_none(), "{name}: {error:?}");
    }
    for (name, array) in
        [("actions", fortran("6, 1")), ("actions", padded(1025)), ("actions", with_dimensions(18))]
    {
        let error = refusal(&changed(&[(name, Some(array))]));
        assert!(matches!(error, Some(NpzError::Array { .. })), "{name}: {error:?}");
    }
    Ok(())
}

#[test]
fn hostile_headers_are_refused() -> Result {
    let huge = "4611686018427387904";
    for (name, header) in [
        ("rewards", plain("<f8", &format!("{huge},"), &[0; 8])),
        ("actions", plain("<f8", &format!("{huge}, {huge}"), &[0; 8])),
        ("actions", plain("<f8", "-6, 1", &[0; 48])),
        ("actions", plain("<f8", "", &[0; 48])),
        ("actions", plain("O", "6, 1", &[0; 48])),
        ("actions", plain("<f9999999999999999", "6, 1", &[0; 48])),
        ("actions", array(1, &"[".repeat(60_000), &[])),
        ("actions", array(1, &"{".repeat(900), &[])),
        ("actions", array(2, "", &[255; 4])),
        ("actions", array(9, "{}", &[])),
        ("actions", b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec()),
        ("actions", b"PK".to_vec()),
    ] {
        assert!(refusal(&changed(&[(name, Some(header.clone()))])).is_some(), "{header:?}");
    }
    // Arrays that claim the same size and do not have it: an archive bomb of zeros.
    let steps = 1_u64 << 40;
    let lengths = plain("<i8", "1,", &(steps as i64).to_le_bytes());
    let matrix =
        |rows: u64, width: u64| Some(plain("<f8", &format!("{rows}, {width}"), &[0; 1 << 16]));
    let bomb = changed(&[
        ("episode_lengths", Some(lengths)),
        ("observations", matrix(steps + 1, 2)),
        ("achieved_goals", matrix(steps + 1, 1)),
        ("desired_goals", matrix(1, 1)),
        ("actions", matrix(steps, 1)),
        ("rewards", matrix(steps, 1)),
        ("fields_log_prob", matrix(steps, 1)),
        ("fields_latent", matrix(steps, 2)),
        ("terminated", Some(plain("|b1", "1,", &[1]))),
        ("truncated", Some(plain("|b1", "1,", &[1]))),
    ]);
    let error = refusal(&bomb).unwrap();
    assert!(matches!(&error, NpzError::Array { array, .. } if array == "observations"), "{error}");
    Ok(())
}
