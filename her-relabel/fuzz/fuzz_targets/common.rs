//! Episodes and batches for all targets.

use goal_reward::DistanceReward;
use her_relabel::{
    AddError, Batch, Dims, EpisodeData, FieldRows, GoalStrategy, HerBuffer, SampleError, Sampler,
    Scalar, StartData, StepData, UnitInterval,
};

pub const DIMS: Dims = Dims { observation: 2, goal: 1, action: 1 };

/// Fills all fields of the buffer with `value`.
pub fn fields<'a, T: Scalar>(buffer: &HerBuffer<T>, value: &'a [f64]) -> Vec<FieldRows<'a, f64>> {
    buffer.config().fields().iter().map(|_| ("value", value)).collect()
}

pub fn begin<T: Scalar>(
    buffer: &mut HerBuffer<T>,
    env: usize,
    episode: u8,
) -> Result<(), AddError> {
    let number = f64::from(episode);
    let start =
        StartData { observation: &[number, 0.0], achieved_goal: &[0.0], desired_goal: &[number] };
    buffer.begin_episode(env, &start)
}

pub fn step<T: Scalar>(
    buffer: &mut HerBuffer<T>,
    env: usize,
    episode: u8,
    t: u8,
    ends: bool,
) -> Result<(), AddError> {
    let (number, t) = (f64::from(episode), f64::from(t));
    let fields = fields(buffer, std::slice::from_ref(&t));
    let step = StepData {
        action: &[t],
        reward: number,
        next_observation: &[number, t + 1.0],
        next_achieved_goal: &[t + 1.0],
        terminated: false,
        truncated: ends,
        fields: &fields,
    };
    buffer.add_step(env, &step)
}

pub fn add_whole<T: Scalar>(buffer: &mut HerBuffer<T>, episode: u8, len: u8) {
    let number = f64::from(episode);
    let observations: Vec<f64> = (0..=len).flat_map(|t| [number, f64::from(t)]).collect();
    let states: Vec<f64> = (0..=len).map(f64::from).collect();
    let steps = &states[..usize::from(len)];
    let data = EpisodeData {
        observation: &observations,
        achieved_goal: &states,
        desired_goal: &[number],
        action: steps,
        reward: &vec![number; steps.len()],
        terminated: true,
        truncated: false,
        fields: &fields(buffer, steps),
    };
    buffer.add_episode(&data).expect("an episode");
}

/// Draws a batch, by priority if the buffer has priorities.
pub fn draw<T: Scalar>(buffer: &HerBuffer<T>) -> Result<Batch<T>, SampleError> {
    let beta = buffer.config().priorities().map(|_| UnitInterval::ONE);
    let sampler =
        Sampler::new(40, GoalStrategy::Random, UnitInterval::from_k(1)).with_priorities(beta);
    let mut batch = Batch::new();
    sampler.sample(buffer, &DistanceReward::sparse(), 7, &mut batch).map(|()| batch)
}
