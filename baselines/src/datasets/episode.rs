//! Records an episode with everything that a data set stores.

use fetch_env::{FetchObservation, GoalObservation, Info, MujocoEnv, Reset, SnapshotEnv, Step};
use goal_reward::{DistanceReward, GoalReward, RewardKind};

use super::error::DatasetError;
use super::metadata::Metadata;
use crate::dims::lengths_of;
use crate::evaluate::{Episode, Event, check_policy, run_episode};
use crate::on_mujoco::OnMujoco;
use crate::policy::{Policy, PolicyError};

type Snapshot = <MujocoEnv as SnapshotEnv>::Snapshot;

/// An episode of `T` steps and `T + 1` states, in row-major matrices.
///
/// ```no_run
/// use baselines::ScriptedPolicy;
/// use baselines::datasets::EpisodeRecord;
/// use fetch_env::{Task, make};
///
/// let mut record = EpisodeRecord::default();
/// record.record(&mut make("FetchPush-v4")?, &mut ScriptedPolicy::new(Task::Push), 7)?;
/// assert_eq!((record.rewards.len(), record.observations.len()), (50, 51 * 25));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct EpisodeRecord {
    /// Seed of the reset.
    pub seed: u64,
    /// The observations of all states, `T + 1` rows.
    pub observations: Vec<f64>,
    /// The goals that the states achieve, `T + 1` rows, in meters.
    pub achieved_goals: Vec<f64>,
    /// The goal to achieve, `T + 1` equal rows, in meters.
    pub desired_goals: Vec<f64>,
    /// The actions, `T` rows.
    pub actions: Vec<f32>,
    /// The environment's own rewards, `T` elements.
    pub rewards: Vec<f64>,
    /// Whether each step ended the task, `T` elements.
    pub terminations: Vec<bool>,
    /// Whether each step was cut off, `T` elements.
    pub truncations: Vec<bool>,
    /// Whether each state counts as a success, `T + 1` elements.
    pub is_success: Vec<bool>,
    /// Distance between the two goals in each state, `T + 1` elements, in meters.
    pub distances: Vec<f64>,
    /// The sparse reward for being in each state, `T + 1` elements.
    pub sparse_rewards: Vec<f64>,
    /// The dense reward for being in each state, `T + 1` elements.
    pub dense_rewards: Vec<f64>,
    /// The joint positions of each state, `T + 1` rows.
    pub qpos: Vec<f64>,
    /// The joint velocities of each state, `T + 1` rows.
    pub qvel: Vec<f64>,
    /// The environment's snapshot in each state: `T + 1` elements if they are
    /// [kept](Self::with_snapshots), none otherwise.
    pub snapshots: Vec<Snapshot>,
    keeps_snapshots: bool,
}

impl EpisodeRecord {
    /// Also keeps a snapshot of each state, from which the episode continues bit for bit. Joint
    /// positions and velocities are not enough for that.
    #[must_use]
    pub const fn with_snapshots(mut self) -> Self {
        self.keeps_snapshots = true;
        self
    }

    /// Runs an episode until it is terminated or truncated, and replaces what was recorded before.
    ///
    /// # Errors
    /// [`DatasetError::Policy`] if the policy does not fit the environment;
    /// [`DatasetError::Environment`] if a reset or a step fails, after which the record does not
    /// hold a whole episode.
    pub fn record(
        &mut self,
        env: &mut impl OnMujoco,
        policy: &mut (impl Policy + ?Sized),
        seed: u64,
    ) -> Result<Episode, DatasetError> {
        check_policy(env, policy)?;
        let failed = |source| DatasetError::Environment { seed, source };
        run_episode(env, policy, seed, failed, |env, event| {
            match event {
                Event::Start(reset) => self.start(env, seed, reset),
                Event::Step(action, step) => self.step(env, action, step),
            }
            Ok(())
        })
    }

    /// Begins an episode, in place of what was recorded before.
    pub(super) fn start(
        &mut self,
        env: &impl OnMujoco,
        seed: u64,
        reset: &Reset<FetchObservation, Info>,
    ) {
        self.clear();
        self.seed = seed;
        self.state(env, &reset.observation, &reset.info);
    }

    /// Adds a step.
    pub(super) fn step(
        &mut self,
        env: &impl OnMujoco,
        action: &[f32],
        step: &Step<FetchObservation, Info>,
    ) {
        self.actions.extend_from_slice(action);
        self.rewards.push(step.reward);
        self.terminations.push(step.terminated);
        self.truncations.push(step.truncated);
        self.state(env, &step.observation, &step.info);
    }

    fn clear(&mut self) {
        let floats = [
            &mut self.observations,
            &mut self.achieved_goals,
            &mut self.desired_goals,
            &mut self.rewards,
            &mut self.distances,
            &mut self.sparse_rewards,
            &mut self.dense_rewards,
            &mut self.qpos,
            &mut self.qvel,
        ];
        floats.into_iter().for_each(Vec::clear);
        self.actions.clear();
        [&mut self.terminations, &mut self.truncations, &mut self.is_success]
            .into_iter()
            .for_each(Vec::clear);
        self.snapshots.clear();
    }

    /// Adds a state.
    fn state(&mut self, env: &impl OnMujoco, observation: &FetchObservation, info: &Info) {
        let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
        self.observations.extend_from_slice(observation.observation());
        self.achieved_goals.extend_from_slice(achieved);
        self.desired_goals.extend_from_slice(desired);
        self.is_success.push(info.is_success);
        self.distances.push(info.distance);
        let threshold = env.config().distance_reward().threshold();
        let reward = |kind| DistanceReward::new(kind, threshold).reward(achieved, desired);
        self.sparse_rewards.push(reward(RewardKind::Sparse));
        self.dense_rewards.push(reward(RewardKind::Dense));
        let data = env.simulator().data();
        self.qpos.extend_from_slice(data.qpos());
        self.qvel.extend_from_slice(data.qvel());
        if self.keeps_snapshots {
            self.snapshots.push(env.snapshot());
        }
    }

    /// Checks that all columns have the lengths of one episode in the environment of a data set, and
    /// that their numbers can be learned from.
    pub(super) fn check(&self, metadata: &Metadata) -> Result<(), DatasetError> {
        let steps = self.rewards.len();
        let states = steps + 1;
        let [qpos, qvel] = metadata.states;
        let [observation, goal, action] =
            lengths_of(&metadata.observation_space, &metadata.action_space)
                .map_err(PolicyError::from)?;
        let columns = [
            ("observations", self.observations.len(), states * observation),
            ("achieved_goals", self.achieved_goals.len(), states * goal),
            ("desired_goals", self.desired_goals.len(), states * goal),
            ("actions", self.actions.len(), steps * action),
            ("terminations", self.terminations.len(), steps),
            ("truncations", self.truncations.len(), steps),
            ("is_success", self.is_success.len(), states),
            ("distances", self.distances.len(), states),
            ("sparse_rewards", self.sparse_rewards.len(), states),
            ("dense_rewards", self.dense_rewards.len(), states),
            ("qpos", self.qpos.len(), states * qpos),
            ("qvel", self.qvel.len(), states * qvel),
        ];
        if let Some((column, actual, expected)) =
            columns.into_iter().find(|(_, actual, expected)| actual != expected)
        {
            return Err(DatasetError::Length { column, actual, expected });
        }
        self.check_numbers()
    }

    /// Checks that all numbers are finite, also for readers that convert them to `f32`.
    fn check_numbers(&self) -> Result<(), DatasetError> {
        let check = |column, value: f64, index| match (value as f32).is_finite() {
            true => Ok(()),
            false => Err(DatasetError::NotFinite { column, index, value }),
        };
        for (index, action) in self.actions.iter().enumerate() {
            check("actions", f64::from(*action), index)?;
        }
        let columns = [
            ("observations", &self.observations),
            ("achieved_goals", &self.achieved_goals),
            ("desired_goals", &self.desired_goals),
            ("rewards", &self.rewards),
            ("distances", &self.distances),
            ("sparse_rewards", &self.sparse_rewards),
            ("dense_rewards", &self.dense_rewards),
            ("qpos", &self.qpos),
            ("qvel", &self.qvel),
        ];
        columns.into_iter().try_for_each(|(column, values)| {
            let mut values = values.iter().enumerate();
            values.try_for_each(|(index, value)| check(column, *value, index))
        })
    }
}
