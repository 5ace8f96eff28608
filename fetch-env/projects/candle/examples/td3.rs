//! TD3 with hindsight, from scratch: environments from `VecEnv`, batches from `HerBuffer`, networks
//! and their gradients from candle. It learns FetchReach within seconds.
//!
//! Source: Fujimoto et al., *Addressing function approximation error in actor-critic methods*,
//! 2018.

use std::error::Error;

use candle_core::{Device, Tensor, Var};
use candle_nn::{AdamW, Optimizer, ParamsAdamW, loss::mse};
use fetch_env::vec_env::{VecConfig, VecStepOf};
use fetch_env::{DistanceReward, MujocoEnv, NpRandom, make_vec};
use her_relabel::{
    Batch, BufferConfig, ColumnsMut, Dims, GoalStrategy, HerBuffer, JoinedGoal, Normalizer,
    NormalizerConfig, Normalizers, Sampler, UnitInterval,
};

type Result<T = (), E = Box<dyn Error>> = std::result::Result<T, E>;

const ENV_ID: &str = "FetchReach-v4";
const DIMS: Dims = Dims { observation: 10, goal: 3, action: 4 };
/// The length of an input: an observation, followed by the goal.
const INPUT: usize = DIMS.observation + DIMS.goal;
const NUM_ENVS: usize = 8;
const HIDDEN: usize = 64;
/// The fraction of the way that target networks move towards the learning ones.
const TARGET_FRACTION: f64 = 0.05;
/// The number of steps before the first update.
const WARM_UP: usize = 1000;
const DEVICE: Device = Device::Cpu;

/// A network with two hidden layers, its target network, and its optimizer.
struct Learning {
    weights: Vec<Var>,
    target: Vec<Var>,
    adam: AdamW,
}

impl Learning {
    fn new(num_inputs: usize, num_outputs: usize, random: &mut NpRandom) -> Result<Self> {
        let sizes = [num_inputs, HIDDEN, HIDDEN, num_outputs];
        let (mut weights, mut target) = (Vec::new(), Vec::new());
        for layer in sizes.windows(2) {
            let bound = 1.0 / (layer[0] as f64).sqrt();
            for shape in [(layer[0], layer[1]), (1, layer[1])] {
                let draw = |_| random.uniform(-bound, bound) as f32;
                let numbers: Vec<f32> = (0..shape.0 * shape.1).map(draw).collect();
                target.push(Var::from_slice(&numbers, shape, &DEVICE)?);
                weights.push(Var::from_vec(numbers, shape, &DEVICE)?);
            }
        }
        let settings = ParamsAdamW { lr: 0.001, weight_decay: 0.0, ..ParamsAdamW::default() };
        Ok(Self { adam: AdamW::new(weights.clone(), settings)?, weights, target })
    }

    /// Takes a step against the gradient of a loss, and lets the target network follow.
    fn step(&mut self, loss: &Tensor) -> candle_core::Result<()> {
        self.adam.backward_step(loss)?;
        for (target, weight) in self.target.iter().zip(&self.weights) {
            let way = ((weight.as_tensor() - target.as_tensor())? * TARGET_FRACTION)?;
            target.set(&(target.as_tensor() + way)?.detach())?;
        }
        Ok(())
    }
}

fn forward(weights: &[Var], input: &Tensor) -> candle_core::Result<Tensor> {
    let mut output = input.clone();
    for (number, layer) in weights.chunks_exact(2).enumerate() {
        let input = if number == 0 { output } else { output.relu()? };
        output = input.matmul(&layer[0])?.broadcast_add(&layer[1])?;
    }
    Ok(output)
}

struct Td3 {
    actor: Learning,
    critics: [Learning; 2],
    observation: Normalizer,
    goal: Normalizer,
    random: NpRandom,
}

impl Td3 {
    fn new(seed: u64) -> Result<Self> {
        let mut random = NpRandom::new(seed);
        let mut learning = |inputs, outputs| Learning::new(inputs, outputs, &mut random);
        Ok(Self {
            actor: learning(INPUT, DIMS.action)?,
            critics: [learning(INPUT + DIMS.action, 1)?, learning(INPUT + DIMS.action, 1)?],
            observation: Normalizer::new(NormalizerConfig::new(DIMS.observation))?,
            goal: Normalizer::new(NormalizerConfig::new(DIMS.goal))?,
            random,
        })
    }

    /// Returns the normalizers of acting and of learning.
    fn normalizers(&self) -> Normalizers<'_> {
        Normalizers { observation: Some(&self.observation), goal: Some(&self.goal) }
    }

    /// Draws a number from the standard normal distribution.
    fn normal(&mut self) -> f64 {
        let [u, v] = [0; 2].map(|_| self.random.uniform(1e-12, 1.0));
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// Returns the actor's actions in the states of a vector, with noise.
    fn act(&mut self, step: &VecStepOf<MujocoEnv>, noise: f64) -> Result<Vec<f32>> {
        let mut input = vec![0.0_f32; step.len() * INPUT];
        self.normalizers().write_input(JoinedGoal::Desired, DIMS, &step.into(), &mut input)?;
        let input = Tensor::from_vec(input, (step.len(), INPUT), &DEVICE)?;
        let actions = forward(&self.actor.weights, &input)?.tanh()?.flatten_all()?;
        let noisy = |action: f32| (action + (noise * self.normal()) as f32).clamp(-1.0, 1.0);
        Ok(actions.to_vec1()?.into_iter().map(noisy).collect())
    }

    /// Takes a step of the critics and, if requested, of the actor.
    fn update(&mut self, batch: &Batch<f32>, actor_learns: bool) -> candle_core::Result<()> {
        let matrix = |column: &[f32]| Tensor::from_slice(column, (batch.len(), ()), &DEVICE);
        let (input, next_input) = (matrix(batch.input())?, matrix(batch.next_input())?);
        // The lower value of the next state, for an action near the target actor's.
        let draw = |_: &f32| (0.2 * self.normal()).clamp(-0.5, 0.5) as f32;
        let noise: Vec<f32> = batch.action().iter().map(draw).collect();
        let next_action = forward(&self.actor.target, &next_input)?.tanh()?;
        let next_action = (next_action + matrix(&noise)?)?.clamp(-1.0_f32, 1.0)?;
        let next = Tensor::cat(&[&next_input, &next_action], 1)?;
        let [first, second] = self.critics.each_ref().map(|critic| forward(&critic.target, &next));
        let value = first?.minimum(&second?)?;
        let target = (matrix(batch.reward())? + (matrix(batch.discount())? * value)?)?.detach();
        let taken = Tensor::cat(&[&input, &matrix(batch.action())?], 1)?;
        for critic in &mut self.critics {
            critic.step(&mse(&forward(&critic.weights, &taken)?, &target)?)?;
        }
        if actor_learns {
            let action = forward(&self.actor.weights, &input)?.tanh()?;
            let seen = Tensor::cat(&[&input, &action], 1)?;
            self.actor.step(&forward(&self.critics[0].weights, &seen)?.mean_all()?.neg()?)?;
        }
        Ok(())
    }

    /// Returns the share of episodes that end in success, without noise.
    fn evaluate(&mut self, num_episodes: usize, seed: u64) -> Result<f64> {
        let mut envs = make_vec(ENV_ID, num_episodes, VecConfig::default())?;
        envs.reset(Some(seed))?;
        for _ in 0..50 {
            let actions = self.act(envs.last_step(), 0.0)?;
            envs.step(&actions)?;
        }
        Ok(envs.last_step().success().map(f64::from).sum::<f64>() / num_episodes as f64)
    }
}

/// Learns until 40 of 40 episodes end in success, and returns the number of steps.
fn train(seed: u64) -> Result<(Td3, usize)> {
    let mut envs = make_vec(ENV_ID, NUM_ENVS, VecConfig::default())?;
    let config = BufferConfig::new(100_000, DIMS).with_num_envs(NUM_ENVS);
    let mut buffer = HerBuffer::<f32>::new(config)?;
    // Four of five rows get a goal that their episode achieved later.
    let sampler = Sampler::new(128, GoalStrategy::Future, UnitInterval::from_k(4))
        .with_joined_goal(JoinedGoal::Desired)
        .with_discount(UnitInterval::new(0.95)?);
    let (mut batch, mut td3) = (Batch::<f32>::new(), Td3::new(seed)?);
    buffer.record(&envs.reset(Some(seed))?.into())?.check()?;
    let mut random = NpRandom::new(seed);
    for steps in (0..20_000).step_by(NUM_ENVS) {
        let actions = td3.act(envs.last_step(), if steps < WARM_UP { 1.0 } else { 0.2 })?;
        let step = envs.step(&actions)?;
        buffer.record(&step.into())?.check()?;
        td3.observation.update(step.observation())?;
        td3.goal.update(step.desired_goal())?;
        for number in 0..if steps < WARM_UP { 0 } else { 4 } {
            let (reward, columns) = (DistanceReward::sparse(), ColumnsMut::default());
            let normalizers = td3.normalizers();
            sampler.sample_into(&buffer, &reward, &mut random, &mut batch, normalizers, columns)?;
            td3.update(&batch, number % 2 == 1)?;
        }
        if steps >= WARM_UP && steps % 800 == 0 && td3.evaluate(40, steps as u64)? == 1.0 {
            return Ok((td3, steps));
        }
    }
    Err("it has not learned within 20,000 steps".into())
}

fn main() -> Result {
    let (mut td3, steps) = train(0)?;
    println!("{} of 100 episodes after {steps} steps", td3.evaluate(100, 1 << 33)? * 100.0);
    Ok(())
}

#[test]
fn it_learns_to_reach() -> Result {
    for seed in 0..3 {
        let (mut td3, steps) = train(seed)?;
        let success_rate = td3.evaluate(50, 1 << 33)?;
        assert_eq!(success_rate, 1.0, "seed {seed}, {steps} steps");
    }
    Ok(())
}
