//! Recorded trajectories of the real environment: one `.npz` file for each task and kind.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use fetch_env::FetchObservation;
use fetch_sim::Task;
use serde::Deserialize;

use super::npz::{Array, Npz};

/// The arrays of a file, whose shapes agree: `E` episodes of `T` steps. Index 0 along `T + 1` is the
/// state after the reset.
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
