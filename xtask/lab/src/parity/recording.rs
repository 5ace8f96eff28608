//! Recorded trajectories of the real environment: one `.npz` file for each task and kind.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use fetch_env::FetchObservation;
use fetch_sim::Task;
use serde::Deserialize;

use super::npz::{Array, Npz};

/// The arrays of a file, whose shapes agree: `E` episodes of `T` steps. Index 0 along `T + 1` is
/// the state after the reset.
pub struct Recording {
    pub path: PathBuf,
    pub meta: Meta,
    pub task: Task,
    pub episodes: usize,
    pub steps: usize,
    pub seeds: Vec<u64>,
    pub initial_gripper_xpos: Vec<f64>,
    pub height_offset: Option<f64>,
    pub actions: Array<f32>,
    pub observation: Array<f64>,
    pub achieved_goal: Array<f64>,
    pub desired_goal: Array<f64>,
    pub qpos: Array<f64>,
    pub qvel: Array<f64>,
    pub reward_dense: Array<f64>,
    pub reward_sparse: Array<f32>,
    pub is_success: Array<f32>,
    pub contacts: Array<i32>,
    pub self_contacts: Array<i32>,
}

#[derive(Clone, Debug, Deserialize)]
pub struct Meta {
    pub env: String,
    pub kind: String,
    pub mujoco: String,
    /// Whether the file says that numpy's arctan2 was the C library's.
    #[serde(default)]
    pub c_arctan2: bool,
    /// Whether the real environment started only after a change to it: see `scripts/start.py`.
    #[serde(default)]
    pub workaround: bool,
}

impl Recording {
    /// Reads a file; the error of a damaged one names the array that is wrong.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        Self::read_archive(path).with_context(|| format!("{} is not a recording", path.display()))
    }

    fn read_archive(path: &Path) -> anyhow::Result<Self> {
        let mut file = Npz::open(path)?;
        let meta: Meta = serde_json::from_str(&file.text("meta")?).context("meta")?;
        let is_of = |task: &Task| meta.env == format!("Fetch{task}Dense-v4");
        let task = Task::ALL.into_iter().find(is_of).with_context(|| {
            format!("it was recorded from {}, which is not a dense Fetch environment", meta.env)
        })?;
        let (nq, nv) = if task.has_object() { (22, 21) } else { (15, 15) };
        let dim = FetchObservation::len_of(task);
        let (_, action_shape) = file.array::<f32>("actions")?;
        let &[episodes, steps, 4] = action_shape.as_slice() else {
            bail!("the array actions has the shape {action_shape:?}, not (E, T, 4)");
        };
        ensure!(episodes > 0 && steps > 0, "the array actions has no steps");
        let seeds = file
            .vector::<i64>("seeds", episodes)?
            .into_iter()
            .map(|seed| u64::try_from(seed).with_context(|| format!("seed {seed}")))
            .collect::<anyhow::Result<_>>()?;
        let states = [episodes, steps + 1];
        let each = [episodes, steps];
        let recording = Self {
            path: path.to_path_buf(),
            task,
            episodes,
            steps,
            seeds,
            initial_gripper_xpos: file.vector("initial_gripper_xpos", 3)?,
            height_offset: file
                .vector("height_offset", 1)?
                .first()
                .copied()
                .filter(|height: &f64| height.is_finite()),
            actions: file.rows("actions", each, Some(4))?,
            observation: file.rows("observation", states, Some(dim))?,
            achieved_goal: file.rows("achieved_goal", states, Some(3))?,
            desired_goal: file.rows("desired_goal", states, Some(3))?,
            qpos: file.rows("qpos", states, Some(nq))?,
            qvel: file.rows("qvel", states, Some(nv))?,
            reward_dense: file.rows("reward_dense", each, None)?,
            reward_sparse: file.rows("reward_sparse", each, None)?,
            is_success: file.rows("is_success", each, None)?,
            contacts: file.rows("contacts", each, None)?,
            self_contacts: file.rows("self_contacts", each, None)?,
            meta,
        };
        ensure!(recording.actions.values.iter().all(|a| a.is_finite()), "an action is not finite");
        Ok(recording)
    }
}

#[cfg(test)]
mod tests {
    use std::{
        fs::{self, File},
        io::{self, Cursor, Read, Write},
    };

    use proptest::{prelude::*, sample::Index};
    use zip::{ZipArchive, ZipWriter, write::SimpleFileOptions};

    use super::Recording;
    use testing::Result;

    const REAL: &str =
        concat!(env!("CARGO_MANIFEST_DIR"), "/tests/recordings/mujoco-2.2.2/reach-still.npz");

    /// Returns the arrays of a real recording; no checksum protects them in a new archive.
    fn arrays() -> Result<Vec<(String, Vec<u8>)>> {
        let mut archive = ZipArchive::new(File::open(REAL)?)?;
        let mut arrays = Vec::new();
        for index in 0..archive.len() {
            let mut file = archive.by_index(index)?;
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes)?;
            arrays.push((file.name()?.into_owned(), bytes));
        }
        Ok(arrays)
    }

    fn archive(arrays: &[(String, Vec<u8>)]) -> Result<Vec<u8>> {
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in arrays {
            archive.start_file(name, SimpleFileOptions::default())?;
            archive.write_all(bytes)?;
        }
        Ok(archive.finish()?.into_inner())
    }

    fn read(archive: &[u8]) -> io::Result<anyhow::Result<Recording>> {
        let file = tempfile::NamedTempFile::new()?;
        fs::write(file.path(), archive)?;
        Ok(Recording::read(file.path()))
    }

    /// Replaces an array of the real recording.
    fn with_array(name: &str, array: Vec<u8>) -> Result<Vec<u8>> {
        let mut arrays = arrays()?;
        let replaced = arrays.iter_mut().find(|(file, _)| *file == format!("{name}.npy"));
        replaced.ok_or("no such array")?.1 = array;
        archive(&arrays)
    }

    /// Returns an array with this header, of version 2, and some zeros.
    fn array(len: u32, header: &str) -> Vec<u8> {
        let mut array = b"\x93NUMPY\x02\0".to_vec();
        array.extend(len.to_le_bytes());
        array.extend(header.as_bytes());
        array.extend([0; 1000]);
        array
    }

    #[test]
    fn headers_that_claim_too_much_are_refused() -> Result {
        let of = |descr: &str, shape: &str| {
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}")
        };
        for name in ["actions", "observation", "seeds", "meta"] {
            for header in [
                of("<f4", "(18446744073709551615, 2, 4)"),
                of("<f4", "(4294967296, 4294967296, 4)"),
                of("<f4", "(0, 18446744073709551615, 4)"),
                of("<f4", "(0, 999999999999, 4)"),
                of("<f4", "(999999999, 50, 4)"),
                of("<U18446744073709551615", "()"),
                of("<U4611686018427387904", "()"),
                of("<f4", &"(".repeat(100_000)),
                of("<f4", &"[".repeat(900)),
                "9".repeat(1000),
            ] {
                let hostile = with_array(name, array(header.len() as u32, &header))?;
                assert!(read(&hostile)?.is_err(), "{name}: {header}");
            }
            let hostile = with_array(name, array(u32::MAX, &of("<f4", "(1, 1, 4)")))?;
            assert!(read(&hostile)?.is_err(), "{name}");
        }
        Ok(())
    }

    /// A small file can hold a large array.
    #[test]
    fn an_array_of_too_many_bytes_is_refused() -> Result {
        let error = read(&with_array("actions", vec![0; 2 << 20])?)?.err().ok_or("it was read")?;
        assert!(format!("{error:#}").contains("the array actions has more than"), "{error:#}");
        Ok(())
    }

    #[derive(Clone, Debug)]
    enum Damage {
        Flip(Index, u8),
        Cut(Index),
        Repeat(Index),
        Overwrite(Index, Vec<u8>),
    }

    impl Damage {
        fn any() -> impl Strategy<Value = Self> {
            let index = any::<Index>;
            let bytes = prop::collection::vec(any::<u8>(), 1..12);
            prop_oneof![
                (index(), 0..8_u8).prop_map(|(at, bit)| Self::Flip(at, bit)),
                index().prop_map(Self::Cut),
                index().prop_map(Self::Repeat),
                (index(), bytes).prop_map(|(at, bytes)| Self::Overwrite(at, bytes)),
            ]
        }

        /// Damages the bytes, only those of the header if `in_header`.
        fn apply(&self, bytes: &mut Vec<u8>, in_header: bool) {
            let len = if in_header { bytes.len().min(128) } else { bytes.len() };
            if len == 0 {
                return;
            }
            match self {
                Self::Flip(at, bit) => bytes[at.index(len)] ^= 1 << bit,
                Self::Cut(at) => bytes.truncate(at.index(len)),
                Self::Repeat(at) => bytes.extend_from_within(at.index(len)..),
                Self::Overwrite(at, new) => {
                    let at = at.index(len);
                    let end = bytes.len().min(at + new.len());
                    bytes[at..end].copy_from_slice(&new[..end - at]);
                }
            }
        }
    }

    proptest! {
        #[test]
        fn damaged_recordings_never_panic(
            array in any::<Index>(),
            damages in prop::collection::vec((Damage::any(), any::<bool>()), 1..4),
            of_archive in prop::option::of(Damage::any()),
        ) {
            let mut arrays = arrays().expect("the recording is whole");
            let (_, bytes) = array.get_mut(&mut arrays);
            damages.iter().for_each(|(damage, in_header)| damage.apply(bytes, *in_header));
            let mut bytes = archive(&arrays).expect("an archive");
            if let Some(damage) = of_archive {
                damage.apply(&mut bytes, false);
            }
            if let Ok(recording) = read(&bytes)? {
                let last = (recording.episodes - 1, recording.steps - 1);
                prop_assert_eq!(recording.actions.row(last.0, last.1).len(), 4);
                prop_assert_eq!(recording.qpos.row(last.0, last.1 + 1).len(), 15);
            }
        }
    }
}
