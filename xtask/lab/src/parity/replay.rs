//! Replays a recording and measures the deviations.

use std::ops::AddAssign;

use fetch_env::{
    Env, EnvId, FetchEnv, FetchObservation, GoalObservation, ObservationField, check::same_bits,
    observation_fields,
};
use fetch_sim::MujocoSimulator;
use goal_reward::{DistanceReward, GoalReward, RewardKind};

use super::{
    counting::{Counting, counting},
    npz::Array,
    recording::Recording,
};

/// Accepted deviation of two values that Python rounds differently by processor and numpy:
/// velocities of sites, because its BLAS has its own order of summing J times qvel, and the
/// object's Euler angles if numpy has its own arctan2. Neither feeds back into the simulation.
const ROUNDING_TOLERANCE: f64 = 1e-15;

#[derive(Clone, Debug, Default)]
pub struct EpisodeParity {
    /// Whether every bit is equal to the recording's, and values that Python rounds differ by at
    /// most 1e-15.
    pub bit_equal: bool,
    /// The largest deviation of an observation or a goal.
    pub deviation: Deviation,
    /// The largest deviation of the first observation or goal, after the reset.
    pub at_reset: Deviation,
    /// Contacts, ours and the recording's.
    pub contacts: [usize; 2],
    /// Contacts between two parts of the robot, ours and the recording's.
    pub self_contacts: [usize; 2],
    /// Sum of the dense rewards, ours and the recording's.
    pub returns: [f64; 2],
}

/// A deviation and where it occurs.
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

    /// Returns the largest of some deviations; `None` if there are none.
    pub fn max<'a>(all: impl IntoIterator<Item = &'a Self>) -> Option<Self> {
        all.into_iter().max_by(|a, b| a.size.total_cmp(&b.size)).cloned()
    }
}

pub fn replay(
    recording: &Recording,
    simulator: MujocoSimulator,
) -> anyhow::Result<Vec<EpisodeParity>> {
    // The environment was recorded without its time limit.
    let config = EnvId { task: recording.task, reward: RewardKind::Dense }.config();
    let mut env = FetchEnv::new(config, counting(simulator)?)?;
    (0..recording.episodes).map(|episode| replay_episode(recording, &mut env, episode)).collect()
}

fn replay_episode(
    recording: &Recording,
    env: &mut FetchEnv<Counting>,
    episode: usize,
) -> anyhow::Result<EpisodeParity> {
    let mut parity = EpisodeParity { bit_equal: true, ..EpisodeParity::default() };
    let first = env.reset(Some(recording.seeds[episode]))?.observation;
    parity.compare_state(recording, env, episode, 0, &first);
    parity.at_reset = parity.deviation.clone();
    for t in 0..recording.steps {
        let step = env.step(recording.actions.row(episode, t))?;
        parity.compare_state(recording, env, episode, t + 1, &step.observation);
        let dense = recording.reward_dense.row(episode, t)[0];
        let sparse = f64::from(recording.reward_sparse.row(episode, t)[0]);
        let success = recording.is_success.row(episode, t)[0] != 0.0;
        let o = step.observation;
        let our_sparse = DistanceReward::sparse().reward(o.achieved_goal(), o.desired_goal());
        parity.bit_equal &= step.reward.to_bits() == dense.to_bits()
            && our_sparse.to_bits() == sparse.to_bits()
            && step.info.is_success == success;
        let counted = &env.simulator().on_step;
        let counts = |column: &Array<i32>| column.row(episode, t)[0].max(0) as usize;
        add(&mut parity.contacts, [counted.all, counts(&recording.contacts)]);
        add(&mut parity.self_contacts, [counted.of_robot, counts(&recording.self_contacts)]);
        add(&mut parity.returns, [step.reward, dense]);
    }
    Ok(parity)
}

fn add<T: AddAssign>(sums: &mut [T; 2], [ours, theirs]: [T; 2]) {
    sums[0] += ours;
    sums[1] += theirs;
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

        let data = env.simulator().simulator.data();
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

/// Returns the indices of the observation's rounded elements: site velocities and, unless arctan2
/// is the C library's, the object's Euler angles.
fn rounded_elements(recording: &Recording) -> Vec<usize> {
    let is_rounded = |field: &&ObservationField| match field.name {
        "grip_velp" | "object_velp" | "object_velr" => true,
        "object_rot" => !recording.meta.c_arctan2,
        _ => false,
    };
    let fields = observation_fields(recording.task).iter().filter(is_rounded);
    fields.flat_map(|field| field.range.clone()).collect()
}
