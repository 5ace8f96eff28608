//! Buffers, their archives, and what is drawn from them.

use std::io::Cursor;

use goal_reward::DistanceReward;
use her_relabel::{
    Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer, Sampler, Scalar, UnitInterval,
};

pub(crate) type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

pub(crate) const DIMS: Dims = Dims { observation: 2, goal: 1, action: 1 };

pub(crate) fn config(capacity: usize) -> BufferConfig {
    BufferConfig::new(capacity, DIMS).with_field("log_prob", 1).with_field("latent", 2)
}

/// Episode `episode` has `episode + 1` steps.
pub(crate) fn add<T: Scalar>(buffer: &mut HerBuffer<T>, episode: u8) {
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

pub(crate) fn filled<T: Scalar>(capacity: usize, episodes: u8) -> HerBuffer<T> {
    let mut buffer = HerBuffer::new(config(capacity)).unwrap();
    (0..episodes).for_each(|episode| add(&mut buffer, episode));
    buffer
}

pub(crate) fn exported<T: Scalar>(buffer: &HerBuffer<T>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    buffer.write_npz(&mut bytes).unwrap();
    bytes.into_inner()
}

/// Everything in a batch except the numbers of its transitions, which differ in another buffer.
pub(crate) fn drawn<T: Scalar>(buffer: &HerBuffer<T>) -> Vec<f64> {
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
