//! Importing trajectories of OGBench.

use std::ops::Range;
use std::path::Path;

use goal_reward::{Dims, GoalReward};
use rawzip::ZipArchive;

use crate::add::arguments::EpisodeData;
use crate::npz::array::{ACTIONS, Array, FLAGS, FLOATS, NpzError, OBSERVATIONS};
use crate::npz::{contents, io_error};
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;

/// The array that marks the last state of each trajectory.
const TERMINALS: &str = "terminals";

/// The columns of the goals in an archive of OGBench.
///
/// ```
/// use her_relabel::GoalColumns;
///
/// // The position of the ant: the first 2 of the 29 columns of AntMaze's observations.
/// let ant = GoalColumns { array: "observations", width: 29, columns: 0..2, desired: None };
/// // The goals of a data set of the Fetch environments.
/// let fetch = GoalColumns {
///     array: "achieved_goals",
///     width: 3,
///     columns: 0..3,
///     desired: Some("desired_goals"),
/// };
/// ```
#[derive(Clone, Debug)]
pub struct GoalColumns<'a> {
    /// The array with the goal that each state achieves.
    pub array: &'a str,
    /// The number of its columns.
    pub width: usize,
    /// The columns that form the goal.
    pub columns: Range<usize>,
    /// The array with the desired goal of each state; the goal of a trajectory is the first one.
    /// With `None`, it is the goal that the trajectory's last state achieves.
    pub desired: Option<&'a str>,
}

impl<T: Scalar> HerBuffer<T> {
    /// Adds all trajectories of an archive of [OGBench](https://github.com/seohongpark/ogbench), in
    /// their order, and returns their number. The buffer must have no fields.
    ///
    /// The archive has a row for each state, and each trajectory ends where `terminals`, of the
    /// type `bool`, is true; the action of that last row is ignored. Each trajectory is truncated
    /// after its last step, and `reward` computes the rewards. Trajectories of a single state are
    /// left out.
    ///
    /// An import takes no more memory than the file and this buffer's capacity, whatever sizes the
    /// archive claims. The file is a regular one of at most 64 GiB.
    ///
    /// # Errors
    /// [`NpzError`]; then no trajectory has been added.
    pub fn import_ogbench(
        &mut self,
        path: impl AsRef<Path>,
        goals: &GoalColumns<'_>,
        reward: &impl GoalReward,
    ) -> Result<u64, NpzError> {
        self.import_ogbench_bytes(&contents(path.as_ref())?, goals, reward)
    }

    /// Adds all trajectories of an archive in memory, as [`import_ogbench`](Self::import_ogbench)
    /// does.
    ///
    /// # Errors
    /// [`NpzError`]; then no trajectory has been added.
    pub fn import_ogbench_bytes(
        &mut self,
        bytes: &[u8],
        goals: &GoalColumns<'_>,
        reward: &impl GoalReward,
    ) -> Result<u64, NpzError> {
        self.import_staged(|staged| read(staged, bytes, goals, reward))
    }
}

/// Adds the trajectories of an archive, whose arrays are read side by side.
fn read<T: Scalar>(
    buffer: &mut HerBuffer<T>,
    bytes: &[u8],
    goals: &GoalColumns<'_>,
    reward: &impl GoalReward,
) -> Result<u64, NpzError> {
    let archive = &ZipArchive::from_slice(bytes).map_err(io_error)?;
    let Dims { observation, goal, action } = buffer.config().dims();
    // The states kept of a trajectory that is longer than the buffer: the last ones.
    let kept = buffer.config().capacity() as u64 + 1;
    let GoalColumns { array, width, ref columns, desired } = *goals;
    if columns.len() != goal || columns.end > width {
        return Err(NpzError::Columns { columns: columns.clone(), width, goal });
    }
    let mut terminals = Array::open(archive, TERMINALS, &FLAGS, 1, None)?;
    let rows = terminals.len();
    let states = Some(rows);
    let mut observations = Array::open(archive, OBSERVATIONS, &FLOATS, observation, states)?;
    let mut actions = Array::open(archive, ACTIONS, &FLOATS, action, states)?;
    let mut achieved_goals = Array::open(archive, array, &FLOATS, width, states)?;
    let mut desired_goals = match desired {
        Some(name) => Some(Array::open(archive, name, &FLOATS, goal, states)?),
        None => None,
    };
    let (mut trajectories, mut row) = (0, 0);
    let mut parts: [Vec<f64>; 4] = Default::default();
    let (mut achieved, mut rewards) = (Vec::new(), Vec::new());
    while row < rows {
        let mut len = 1;
        while !terminals.next()? {
            len += 1;
            if row + len > rows {
                return Err(NpzError::Unended { row });
            }
        }
        row += len;
        let [observed, acted, columns_of_goals, wanted] = &mut parts;
        observations.take(len, kept, observed)?;
        actions.take(len, kept, acted)?;
        achieved_goals.take(len, kept, columns_of_goals)?;
        achieved.clear();
        for row in columns_of_goals.chunks_exact(width) {
            achieved.extend_from_slice(&row[columns.clone()]);
        }
        match &mut desired_goals {
            Some(array) => {
                array.take(1, 1, wanted)?;
                let first = wanted.clone();
                array.take(len - 1, 0, wanted)?;
                *wanted = first;
            }
            None => *wanted = achieved[achieved.len() - goal..].to_vec(),
        }
        acted.truncate(acted.len() - action);
        rewards.clear();
        let steps = achieved.chunks_exact(goal).skip(1);
        // Goals without a reward give NaN, which the buffer refuses.
        let reward_of = |achieved| reward.try_reward(achieved, wanted).unwrap_or(f64::NAN);
        rewards.extend(steps.map(reward_of));
        if rewards.is_empty() {
            continue;
        }
        let data = EpisodeData {
            observation: observed,
            achieved_goal: &achieved,
            desired_goal: wanted,
            action: acted,
            reward: &rewards,
            terminated: false,
            truncated: true,
            fields: &[],
        };
        let added = buffer.add_episode(&data);
        added.map_err(|source| NpzError::Episode { episode: trajectories, source })?;
        trajectories += 1;
    }
    terminals.finish()?;
    let matrices = [observations, actions, achieved_goals].into_iter().chain(desired_goals);
    matrices.into_iter().try_for_each(Array::finish)?;
    Ok(trajectories)
}
