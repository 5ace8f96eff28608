//! The bit flipping task, and Q-learning without a deep learning library.
//!
//! A state and a goal have [`BITS`] bits each, an action flips one bit of the state, and the reward
//! is 0 for reaching the goal and -1 otherwise. A random walk of 15 steps hardly ever reaches the
//! desired one of 32768 goals, so ordinary experience replay sees no reward to learn from.
//!
//! Source: Andrychowicz et al., *Hindsight Experience Replay*, 2017, section 3.1.

use goal_reward::GoalReward;
use her_relabel::{
    Batch, BufferConfig, Dims, GoalStrategy, HerBuffer, Sampler, StartData, StepData, Termination,
    UnitInterval,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

pub(crate) const BITS: usize = 15;
type Bits = [f32; BITS];

const GAMMA: f64 = 0.98;
/// The share of random actions while learning.
const EPSILON: f64 = 0.2;
const LEARNING_RATE: f64 = 0.02;
const BATCH_SIZE: usize = 128;
const BATCHES_PER_EPISODE: usize = 4;
/// The number of episodes between updates of the target network.
const TARGET_EPISODES: usize = 10;

/// A reward of 0 if all bits agree, which ends the task, and -1 otherwise.
struct AllBits;

impl GoalReward for AllBits {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        if achieved_goal == desired_goal { 0.0 } else { -1.0 }
    }

    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal == desired_goal
    }

    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal == desired_goal
    }
}

/// A network of one layer that maps the bits that differ from the goal's to the value of each
/// action. Its inputs are the same with and without hindsight.
#[derive(Clone)]
struct Network {
    /// One weight per bit, and the bias, for each action.
    weights: Vec<[f64; BITS + 1]>,
}

impl Network {
    fn new() -> Self {
        Self { weights: vec![[0.0; BITS + 1]; BITS] }
    }

    fn value(&self, inputs: &[f64; BITS + 1], action: usize) -> f64 {
        self.weights[action].iter().zip(inputs).map(|(weight, input)| weight * input).sum()
    }

    fn best(&self, inputs: &[f64; BITS + 1]) -> (usize, f64) {
        let values = (0..BITS).map(|action| (action, self.value(inputs, action)));
        values.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
    }

    /// Takes a step down the gradient of the squared error.
    fn learn(&mut self, inputs: &[f64; BITS + 1], action: usize, target: f64) {
        let error = target - self.value(inputs, action);
        for (weight, input) in self.weights[action].iter_mut().zip(inputs) {
            *weight += LEARNING_RATE * error * input;
        }
    }
}

/// Returns -1 for each bit that agrees with the goal's and 1 for each that differs, both equally
/// far from 0, and a 1 for the bias.
fn inputs(state: &[f32], goal: &[f32]) -> [f64; BITS + 1] {
    let mut inputs = [1.0; BITS + 1];
    for (input, (state, goal)) in inputs.iter_mut().zip(state.iter().zip(goal)) {
        *input = if state == goal { -1.0 } else { 1.0 };
    }
    inputs
}

fn random_bits(rng: &mut ChaCha8Rng) -> Bits {
    let word = rng.next_u64();
    std::array::from_fn(|bit| (word >> bit & 1) as f32)
}

fn random_unit(rng: &mut ChaCha8Rng) -> f64 {
    f64::from(rng.next_u32()) / (f64::from(u32::MAX) + 1.0)
}

/// Learns from `episodes` episodes and returns the share of 200 new goals that the greedy policy
/// reaches within [`BITS`] steps.
pub(crate) fn learn(ratio: UnitInterval, episodes: usize, seed: u64) -> Result<f64, Failure> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let dims = Dims { observation: BITS, goal: BITS, action: 1 };
    let mut buffer = HerBuffer::<f32>::new(BufferConfig::new(100_000, dims))?;
    let sampler = Sampler::new(BATCH_SIZE, GoalStrategy::Future, ratio)
        .with_termination(Termination::Recomputed);
    let mut batch = Batch::new();
    let mut network = Network::new();
    let mut target = network.clone();
    for episode in 0..episodes {
        play(&mut buffer, &network, &mut rng)?;
        for _ in 0..BATCHES_PER_EPISODE {
            sampler.sample(&buffer, &AllBits, &mut rng, &mut batch)?;
            learn_batch(&mut network, &target, &batch);
        }
        if episode % TARGET_EPISODES == 0 {
            target = network.clone();
        }
    }
    let trials = 200;
    let reached = (0..trials).filter(|_| reaches(&network, &mut rng)).count();
    Ok(reached as f64 / f64::from(trials))
}

/// Any error.
pub(crate) type Failure = Box<dyn std::error::Error>;

/// Adds an episode with some random actions to the buffer.
fn play(
    buffer: &mut HerBuffer<f32>,
    network: &Network,
    rng: &mut ChaCha8Rng,
) -> Result<(), Failure> {
    let (mut state, goal) = (random_bits(rng), random_bits(rng));
    let start = StartData { observation: &state, achieved_goal: &state, desired_goal: &goal };
    buffer.begin_episode(0, &start)?;
    for step in 1..=BITS {
        let action = if random_unit(rng) < EPSILON {
            rng.next_u32() as usize % BITS
        } else {
            network.best(&inputs(&state, &goal)).0
        };
        state[action] = 1.0 - state[action];
        let reached = state == goal;
        let step = StepData {
            action: &[action as f32],
            reward: if reached { 0.0 } else { -1.0 },
            next_observation: &state,
            next_achieved_goal: &state,
            terminated: reached,
            truncated: step == BITS,
            fields: &[],
        };
        buffer.add_step(0, &step)?;
        if reached {
            break;
        }
    }
    Ok(())
}

/// Q-learning: the value of an action is its reward plus the discounted best value of the next
/// state.
fn learn_batch(network: &mut Network, target: &Network, batch: &Batch<f32>) {
    for row in 0..batch.len() {
        let bits = row * BITS..(row + 1) * BITS;
        let goal = &batch.desired_goal()[bits.clone()];
        let next = inputs(&batch.next_observation()[bits.clone()], goal);
        let later = if batch.terminated()[row] { 0.0 } else { target.best(&next).1 };
        let value = f64::from(batch.reward()[row]) + GAMMA * later;
        // All returns are within these bounds.
        let value = value.clamp(-1.0 / (1.0 - GAMMA), 0.0);
        let action = batch.action()[row] as usize;
        network.learn(&inputs(&batch.observation()[bits], goal), action, value);
    }
}

/// Returns whether the greedy policy reaches a random goal from a random state.
fn reaches(network: &Network, rng: &mut ChaCha8Rng) -> bool {
    let (mut state, goal) = (random_bits(rng), random_bits(rng));
    for _ in 0..BITS {
        let action = network.best(&inputs(&state, &goal)).0;
        state[action] = 1.0 - state[action];
        if state == goal {
            return true;
        }
    }
    false
}
