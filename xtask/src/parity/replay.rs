//! A recording replayed: what differs, by how much, and where.

use std::ops::Range;

use fetch_env::{Env, EnvId, FetchEnv, FetchObservation, GoalObservation, ObservationField};
use fetch_sim::MujocoSimulator;
use goal_reward::{DistanceReward, GoalReward, RewardKind};

use super::{counting::Counting, recording::Recording};

/// What Python rounds by its processor and its numpy: a site's velocity, because its BLAS sums J
/// times qvel in an order of its own, and the object's Euler angles where numpy has an arctan2 of its
/// own. Nothing feeds back from either.
const ROUNDING_TOLERANCE: f64 = 1e-15;

/// How an episode compares.
#[derive(Clone, Debug)]
pub struct EpisodeParity {
    /// Every bit is the recording's; what Python rounds by its processor is within 1e-15.
    pub bit_equal: bool,
    /// The largest deviation of an observation or a goal.
    pub deviation: Deviation,
    /// The largest deviation of the first observation or goal, after the reset.
    pub at_reset: Deviation,
    /// Contacts here and there, all of them.
    pub contacts: [usize; 2],
    /// Contacts between two parts of the robot, here and there.
    pub self_contacts: [usize; 2],
    /// Sum of the dense rewards, here and there.
    pub returns: [f64; 2],
}

/// A deviation and its place.
#[derive(Clone, Debug, Default)]
pub struct Deviation {
    pub size: f64,
    pub place: String,
}

impl Deviation {
    fn note(&mut self, what: &str, step: usize, ours: &[f64], theirs: &[f64]) {
        for (index, (a, b)) in ours.iter().zip(theirs).enumerate() {
            let size = (a - b).abs();
            if size > self.size || size.is_nan() {
                *self = Self { size, place: format!("step {step}, {what}[{index}]") };
            }
        }
    }

    /// The largest of some; `None` of none.
    pub fn max<'a>(all: impl IntoIterator<Item = &'a Self>) -> Option<Self> {
        all.into_iter().max_by(|a, b| a.size.total_cmp(&b.size)).cloned()
    }
}

/// Replays one file.
pub fn replay(
    recording: &Recording,
    simulator: MujocoSimulator,
) -> anyhow::Result<Vec<EpisodeParity>> {
    // The recordings are of the environment without its time limit.
    let config = EnvId { task: recording.task, reward: RewardKind::Dense }.config();
    let mut env = FetchEnv::new(config, Counting::new(simulator)?)?;
    (0..recording.episodes).map(|episode| replay_episode(recording, &mut env, episode)).collect()
}

fn replay_episode(
    recording: &Recording,
    env: &mut FetchEnv<Counting>,
    episode: usize,
) -> anyhow::Result<EpisodeParity> {
    let mut parity = EpisodeParity {
        bit_equal: true,
        deviation: Deviation::default(),
        at_reset: Deviation::default(),
        contacts: [0; 2],
        self_contacts: [0; 2],
        returns: [0.0; 2],
    };
    let first = env.reset(Some(recording.seeds[episode]))?.observation;
    parity.compare_state(recording, env, episode, 0, &first);
    parity.at_reset = parity.deviation.clone();
    for t in 0..recording.steps {
        let step = env.step(recording.action(episode, t))?;
        parity.compare_state(recording, env, episode, t + 1, &step.observation);
        let theirs = recording.step(episode, t);
        let (achieved, desired) =
            (step.observation.achieved_goal(), step.observation.desired_goal());
        let sparse = DistanceReward::sparse().reward(achieved, desired);
        parity.bit_equal &= step.reward.to_bits() == theirs.reward_dense.to_bits()
            && sparse.to_bits() == theirs.reward_sparse.to_bits()
            && step.info.is_success == theirs.is_success;
        let simulator = env.simulator();
        for (sum, counted) in
            parity.contacts.iter_mut().zip([simulator.contacts(), theirs.contacts])
        {
            *sum += counted;
        }
        let self_contacts = [simulator.self_contacts(), theirs.self_contacts];
        for (sum, counted) in parity.self_contacts.iter_mut().zip(self_contacts) {
            *sum += counted;
        }
        for (sum, reward) in parity.returns.iter_mut().zip([step.reward, theirs.reward_dense]) {
            *sum += reward;
        }
    }
    Ok(parity)
}

impl EpisodeParity {
    fn compare_state(
        &mut self,
        recording: &Recording,
        env: &FetchEnv<Counting>,
        episode: usize,
        t: usize,
        ours: &FetchObservation,
    ) {
        let observation = recording.observation.row(episode, t);
        let achieved = recording.achieved_goal.row(episode, t);
        let desired = recording.desired_goal.row(episode, t);
        self.deviation.note("observation", t, ours.observation(), observation);
        self.deviation.note("achieved_goal", t, ours.achieved_goal(), achieved);
        self.deviation.note("desired_goal", t, ours.desired_goal(), desired);

        let data = env.simulator().mujoco().data();
        let rounded = rounded_elements(recording);
        let observed = ours.observation().iter().zip(observation).enumerate().all(|(i, (a, b))| {
            if rounded.contains(&i) {
                (a - b).abs() <= ROUNDING_TOLERANCE
            } else {
                a.to_bits() == b.to_bits()
            }
        });
        self.bit_equal &= observed
            && same_bits(ours.achieved_goal(), achieved)
            && same_bits(ours.desired_goal(), desired)
            && same_bits(data.qpos(), recording.qpos.row(episode, t))
            && same_bits(data.qvel(), recording.qvel.row(episode, t));
    }
}

/// Indices of the velocities of sites in an observation, and of the object's Euler angles before them.
fn rounded_elements(recording: &Recording) -> Range<usize> {
    let field = |name| ObservationField::find(recording.task, name);
    let first = if recording.meta.c_arctan2 { "object_velp" } else { "object_rot" };
    match (field(first).or(field("grip_velp")), field("grip_velp")) {
        (Some(first), Some(last)) => first.range.start..last.range.end,
        _ => 0..0,
    }
}

fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}
