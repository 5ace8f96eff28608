//! How fast a buffer fills and is sampled, and how much memory it takes.
//!
//! `cargo run --release -p her-relabel --example throughput -- [f32|f64] [transitions]` prints one figure a
//! line: name, value, unit. The task is FetchPush's shape (observation 25, goals 3, action 4, episodes of
//! 50 steps), k = 4, future goals, sparse reward, one thread; a step is added after every batch. Each
//! figure is the median of [`ROUNDS`] rounds; start the process several times to see how far they vary.
#![allow(clippy::print_stdout, reason = "an example that prints is the point")]

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use goal_reward::DistanceReward;
use her_relabel::{
    Batch, BufferConfig, Dims, EpisodeData, EpisodeStart, GoalStrategy, HerBuffer, RelabelRatio,
    Sampler, Scalar, Step,
};

const DIMS: Dims = Dims { observation: 25, goal: 3, action: 4 };
const STEPS: usize = 50;
const ROUNDS: usize = 7;
/// Rows drawn in a round.
const ROWS: usize = 2_000_000;

type Failure = Box<dyn Error>;

/// Plausible numbers: everything small, the goals on a random walk of a few centimetres a step.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.0 >> 40) as f64 / (1_u64 << 24) as f64 - 0.5
    }
}

/// An episode of [`STEPS`] steps.
#[derive(Default)]
struct Episode<T> {
    observations: Vec<T>,
    achieved_goals: Vec<T>,
    desired_goal: Vec<T>,
    actions: Vec<T>,
    rewards: Vec<T>,
}

impl<T: Scalar> Episode<T> {
    fn new(numbers: &mut Numbers) -> Self {
        let mut take = |count: usize, scale: f64| -> Vec<T> {
            (0..count).map(|_| T::from_f64(numbers.next() * scale)).collect()
        };
        let mut episode = Self {
            observations: take((STEPS + 1) * DIMS.observation, 1.0),
            achieved_goals: take((STEPS + 1) * DIMS.goal, 0.05),
            desired_goal: take(DIMS.goal, 0.3),
            actions: take(STEPS * DIMS.action, 2.0),
            rewards: vec![T::from_f64(-1.0); STEPS],
        };
        for at in DIMS.goal..episode.achieved_goals.len() {
            let walked = episode.achieved_goals[at].to_f64()
                + episode.achieved_goals[at - DIMS.goal].to_f64();
            episode.achieved_goals[at] = T::from_f64(walked);
        }
        episode
    }

    fn data(&self) -> EpisodeData<'_, T> {
        EpisodeData {
            observations: &self.observations,
            achieved_goals: &self.achieved_goals,
            desired_goal: &self.desired_goal,
            actions: &self.actions,
            rewards: &self.rewards,
            terminated: false,
            truncated: true,
            fields: &[],
        }
    }

    fn start(&self) -> EpisodeStart<'_, T> {
        EpisodeStart {
            observation: &self.observations[..DIMS.observation],
            achieved_goal: &self.achieved_goals[..DIMS.goal],
            desired_goal: &self.desired_goal,
        }
    }

    fn step(&self, t: usize) -> Step<'_, T> {
        Step {
            action: &self.actions[t * DIMS.action..][..DIMS.action],
            reward: self.rewards[t],
            next_observation: &self.observations[(t + 1) * DIMS.observation..][..DIMS.observation],
            next_achieved_goal: &self.achieved_goals[(t + 1) * DIMS.goal..][..DIMS.goal],
            terminated: false,
            truncated: t + 1 == STEPS,
            fields: &[],
        }
    }
}

/// Adds single steps for ever, environment after environment.
struct Stepper<'a, T> {
    episodes: &'a [Episode<T>],
    n_envs: usize,
    added: usize,
}

impl<T: Scalar> Stepper<'_, T> {
    fn step(&mut self, buffer: &mut HerBuffer<T>) -> Result<(), Failure> {
        let env = self.added % self.n_envs;
        let t = self.added / self.n_envs % STEPS;
        let round = self.added / (self.n_envs * STEPS);
        let episode = &self.episodes[(round * self.n_envs + env) % self.episodes.len()];
        if t == 0 {
            buffer.begin_episode(env, &episode.start())?;
        }
        buffer.add_step(env, &episode.step(t))?;
        self.added += 1;
        Ok(())
    }
}

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let element = arguments.next().unwrap_or_else(|| "f32".to_owned());
    let transitions = arguments.next().map_or(Ok(1_000_000), |count| count.parse())?;
    match element.as_str() {
        "f32" => measure::<f32>("f32", transitions),
        "f64" => measure::<f64>("f64", transitions),
        _ => Err(format!("`{element}` is no element type; write f32 or f64").into()),
    }
}

fn measure<T: Scalar>(element: &str, transitions: usize) -> Result<(), Failure> {
    let mut numbers = Numbers(1);
    // Different enough, and small enough to stay in the cache: the table is what is measured.
    let episodes: Vec<Episode<T>> = (0..64).map(|_| Episode::new(&mut numbers)).collect();
    let report = |what: &str, value: f64, unit: &str| {
        println!("her/{element}/{transitions}/{what} {value:.1} {unit}");
    };

    let before = resident_bytes();
    let config = BufferConfig::new(transitions, DIMS);
    let mut buffer = HerBuffer::<T>::new(config.clone().with_n_envs(8))?;
    for episode in episodes.iter().cycle().take(transitions.div_ceil(STEPS)) {
        buffer.add_episode(&episode.data())?;
    }
    if let (Some(before), Some(after)) = (before, resident_bytes()) {
        report("bytes-per-transition", (after - before) / buffer.len() as f64, "bytes");
    }

    let mut stepper = Stepper { episodes: &episodes, n_envs: 1, added: 0 };
    let mut batch = Batch::new();
    let mut seed = 0;
    for batch_size in [256, 1024, 4096] {
        let sampler = Sampler::new(batch_size, GoalStrategy::Future, RelabelRatio::from_k(4));
        let reward = DistanceReward::sparse();
        let batches = ROWS.div_ceil(batch_size);
        let rate = median(|| {
            for _ in 0..batches {
                sampler.sample_seeded(&buffer, &reward, seed, &mut batch)?;
                black_box(&batch);
                stepper.step(&mut buffer)?;
                seed += 1;
            }
            Ok(batches * batch_size)
        })?;
        report(&format!("batch-{batch_size}"), rate / 1e6, "million rows/s");
    }

    // The buffer is full by now, so that every addition also drops something.
    let by_episode = median(|| {
        for episode in episodes.iter().cycle().take(10_000) {
            buffer.add_episode(&episode.data())?;
        }
        Ok(10_000 * STEPS)
    })?;
    report("insert-episodes", by_episode / 1e6, "million transitions/s");
    buffer.discard_episode(0).unwrap_or(());
    for n_envs in [1, 8] {
        let mut stepper = Stepper { episodes: &episodes, n_envs, added: 0 };
        let by_step = median(|| {
            for _ in 0..10_000 * STEPS {
                stepper.step(&mut buffer)?;
            }
            Ok(10_000 * STEPS)
        })?;
        report(&format!("insert-steps-{n_envs}"), by_step / 1e6, "million transitions/s");
    }
    Ok(())
}

/// The median rate of [`ROUNDS`] rounds of `work`, which returns how much it did.
fn median(mut work: impl FnMut() -> Result<usize, Failure>) -> Result<f64, Failure> {
    let mut rates = Vec::with_capacity(ROUNDS);
    work()?;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        let done = work()? as f64;
        rates.push(done / start.elapsed().as_secs_f64());
    }
    rates.sort_by(f64::total_cmp);
    Ok(rates[ROUNDS / 2])
}

/// The memory of this process that is in RAM; `None` where /proc does not say.
fn resident_bytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024.0)
}
