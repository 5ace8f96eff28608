//! `bench learn`: measures updates of DDPG and SAC, compared with a plain product of two 256 x 256
//! matrices and with PyTorch, drawing their batches, and how soon Reach is learned.

mod product;
mod reach;

use std::{hint::black_box, sync::Arc, time::Duration};

use baselines::{
    Collector, RandomPolicy, buffer_config,
    learn::{
        AlgorithmInit, AlgorithmSettings, DdpgSettings, SacSettings, TrainSettings, Transitions,
    },
};
use fetch_env::{Env, Task, VecEnv, make_kinematic, vec_env::VecConfig};
use goal_reward::DistanceReward;
use her_relabel::{
    Batch, ColumnsMut, Dims, GoalStrategy, HerBuffer, JoinedGoal, Normalizer, NormalizerConfig,
    Normalizers, Sampler, UnitInterval,
};
use rayon::ThreadPoolBuilder;
use serde::Serialize;

use super::{
    interleaved::{Clock, Entry, interleave},
    peer::{Orders, Peer},
    report,
};
use crate::shared::python;
use fetch_cli::shared::json::Metric;

/// The script of the peers.
const LEARNERS: (&str, &str) = ("learners.py", include_str!("../../../scripts/learners.py"));

/// The length of a row and of a column of the matrices.
const SIZE: usize = 256;
const BATCH: usize = 256;
/// The number of updates in a turn: those of a cycle of the preset `fast`. Short turns would
/// measure how long the machine's second core takes to wake up.
const UPDATES: usize = 160;
const DRAWS: usize = 200;

#[derive(Debug, clap::Args, Serialize)]
pub struct Args {
    /// Seconds of measuring for each size of the networks
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..))]
    seconds: u16,
    /// Also measure PyTorch, and learn Reach with Stable-Baselines3, which takes minutes
    #[arg(long)]
    peers: bool,
}

pub fn run(args: &Args) -> anyhow::Result<Vec<(String, Metric)>> {
    let buffer = Arc::new(Replay::new()?);
    let mut figures = Vec::new();
    for num_hidden in [2, 3] {
        let hidden = vec![SIZE; num_hidden];
        let operations = operations(buffer.dims, &hidden);
        let mut entries = vec![
            Entry::new("product", "operations/s", product::contender(1)?),
            Entry::new("products-2", "operations/s", product::contender(2)?),
        ];
        for num_threads in [1, 2] {
            let name = format!("threads-{num_threads}");
            let learner = learner(&buffer, &ddpg(&hidden), num_threads, operations)?;
            entries.push(Entry::new(&name, "operations/s", learner));
        }
        if args.peers {
            let python = python::environment("python-learners", &python::LEARNERS)?;
            let arguments = ["time".into(), num_hidden.to_string()];
            let peer = Peer::start(&python, LEARNERS, &arguments, "disable")?;
            let order = format!("update {UPDATES} {operations}");
            entries.push(Entry::new("pytorch", "operations/s", Orders::new(&peer, order)));
        }
        let rounds = interleave(entries, Duration::from_secs(args.seconds.into()))?;
        let ratios = [
            rounds.ratio("share-of-product", Clock::Wall, "threads-1", "product"),
            rounds.ratio("two-threads-to-one", Clock::Wall, "threads-2", "threads-1"),
            // What the machine allows.
            rounds.ratio("two-products-to-one", Clock::Wall, "products-2", "product"),
            rounds.ratio("times-pytorch", Clock::Wall, "threads-1", "pytorch"),
        ];
        let updates = rounds.figures().filter(|(name, _)| !name.starts_with("product")).map(
            |(name, speed)| {
                (format!("{name}/updates"), Metric::new(speed.value / operations as f64, "1/s"))
            },
        );
        let updates: Vec<_> = updates.collect();
        let prefix = format!("learn/ddpg-{num_hidden}x{SIZE}");
        report(
            &mut figures,
            &prefix,
            rounds.figures().chain(updates).chain(ratios.into_iter().flatten()),
        )?;
    }
    let entries = vec![
        Entry::new("draw", "1/s", draw(&buffer)),
        Entry::new("update", "1/s", learner(&buffer, &ddpg(&[SIZE; 2]), 1, 1)?),
        Entry::new("sac-update", "1/s", learner(&buffer, &sac(), 1, 1)?),
    ];
    let rounds = interleave(entries, Duration::from_secs(args.seconds.into()))?;
    let ratios = [
        rounds.ratio("share-of-update", Clock::Wall, "update", "draw"),
        rounds.ratio("sac-to-ddpg", Clock::Wall, "sac-update", "update"),
    ];
    report(&mut figures, "learn/draw", rounds.figures().chain(ratios.into_iter().flatten()))?;
    report(&mut figures, "learn/reach", reach::measure(args.peers)?)?;
    Ok(figures)
}

/// Random episodes of Push, and how a trainer draws batches of them.
struct Replay {
    buffer: HerBuffer<f32>,
    dims: Dims,
    sampler: Sampler,
    observation: Normalizer,
    /// The normalizer of relative goals.
    goal: Normalizer,
}

/// A batch, kept for its memory.
#[derive(Default)]
struct Drawn {
    batch: Batch<f32>,
    input: Vec<f32>,
    next_input: Vec<f32>,
}

impl Replay {
    fn new() -> anyhow::Result<Self> {
        let envs = (0..8).map(|_| make_kinematic("FetchPush-v4")).collect::<Result<Vec<_>, _>>()?;
        let config = buffer_config(100_000, &envs[0])?.with_num_envs(envs.len());
        let dims = config.dims();
        let mut buffer = HerBuffer::new(config)?;
        let mut policy = RandomPolicy::new(envs[0].action_space(), 0);
        let mut collector = Collector::new(VecEnv::new(envs, VecConfig::default())?);
        collector.collect(1_020, &mut policy, &mut buffer, |_, _| ())?;
        let TrainSettings { replay, inputs, .. } = TrainSettings::fast(Task::Push);
        let ratio = UnitInterval::from_k(4);
        let sampler = Sampler::new(BATCH, GoalStrategy::Future, ratio)
            .with_keep_already_achieved(UnitInterval::new(replay.keep_already_achieved)?)
            .with_discount(UnitInterval::new(DdpgSettings::default().gamma)?)
            .with_joined_goal(JoinedGoal::Relative);
        let mut batch = Batch::<f32>::new();
        sampler.sample(&buffer, &DistanceReward::sparse(), 0, &mut batch)?;
        let normalizer = |dim, numbers: &[f32]| -> anyhow::Result<Normalizer> {
            let config =
                NormalizerConfig::new(dim).with_min_std(inputs.min_std).with_clip(inputs.clip);
            let mut normalizer = Normalizer::new(config)?;
            normalizer.update(numbers)?;
            Ok(normalizer)
        };
        let goals = batch.desired_goal().iter().zip(batch.achieved_goal());
        let relative_goals: Vec<f32> =
            goals.map(|(desired, achieved)| desired - achieved).collect();
        Ok(Self {
            observation: normalizer(dims.observation, batch.observation())?,
            goal: normalizer(dims.goal, &relative_goals)?,
            buffer,
            dims,
            sampler,
        })
    }

    fn draw<'a>(&self, seed: u64, drawn: &'a mut Drawn) -> anyhow::Result<Transitions<'a>> {
        let Drawn { batch, input, next_input } = drawn;
        let len = BATCH * (self.dims.observation + self.dims.goal);
        input.resize(len, 0.0);
        next_input.resize(len, 0.0);
        let normalizers =
            Normalizers { observation: Some(&self.observation), goal: Some(&self.goal) };
        let columns = ColumnsMut { input, next_input, ..ColumnsMut::default() };
        let reward = DistanceReward::sparse();
        self.sampler.sample_into(&self.buffer, &reward, seed, batch, normalizers, columns)?;
        Ok(Transitions {
            len: batch.len(),
            input,
            actor_input: input,
            action: batch.action(),
            reward: batch.reward(),
            discount: batch.discount(),
            next_input,
            next_actor_input: next_input,
            demonstrated: &[false; BATCH],
            ..Transitions::default()
        })
    }
}

fn ddpg(hidden: &[usize]) -> AlgorithmSettings {
    AlgorithmSettings::Ddpg(DdpgSettings { hidden: hidden.to_vec(), ..DdpgSettings::default() })
}

/// Returns SAC of the preset `book`, with networks of the same size as DDPG's.
fn sac() -> AlgorithmSettings {
    AlgorithmSettings::Sac(SacSettings { hidden: vec![SIZE; 2], ..SacSettings::book() })
}

/// Draws batches and updates by them; each update counts as `work`.
fn learner(
    replay: &Arc<Replay>,
    algorithm: &AlgorithmSettings,
    num_threads: usize,
    work: usize,
) -> anyhow::Result<impl FnMut() -> anyhow::Result<usize> + use<>> {
    let pool = ThreadPoolBuilder::new().num_threads(num_threads).build()?;
    let Dims { observation, goal, action } = replay.dims;
    let init = AlgorithmInit {
        num_inputs: observation + goal,
        num_actions: action,
        reward_bounds: -1.0..=0.0,
        seed: 0,
        rank: 0,
    };
    let mut algorithm = algorithm.build(init)?;
    let (replay, mut drawn, mut seed) = (Arc::clone(replay), Drawn::default(), 0);
    Ok(move || {
        pool.install(|| {
            for _ in 0..UPDATES {
                seed += 1;
                let batch = replay.draw(seed, &mut drawn)?;
                black_box(algorithm.update(batch, &mut |_| ()));
            }
            Ok(UPDATES * work)
        })
    })
}

fn draw(replay: &Arc<Replay>) -> impl FnMut() -> anyhow::Result<usize> + use<> {
    let (replay, mut drawn, mut seed) = (Arc::clone(replay), Drawn::default(), 0);
    move || {
        for _ in 0..DRAWS {
            seed += 1;
            black_box(replay.draw(seed, &mut drawn)?);
        }
        Ok(DRAWS)
    }
}

/// Returns the number of floating-point operations in the matrix products of an update.
fn operations(dims: Dims, hidden: &[usize]) -> usize {
    let weights = |inputs: usize, outputs: usize| -> [usize; 2] {
        let sizes = [&[inputs], hidden, &[outputs]].concat();
        let all = sizes.windows(2).map(|pair| pair[0] * pair[1]).sum();
        [all, inputs * sizes[1]]
    };
    let Dims { observation, goal, action } = dims;
    let [actor, actor_first] = weights(observation + goal, action);
    let [critic, critic_first] = weights(observation + goal + action, 1);
    // Targets; the critic forward and backward, except the gradient of its inputs; the same for the
    // actor; and the critic once more, forward and backward to the actions.
    let targets = actor + critic;
    let learned = 3 * critic - critic_first + 3 * actor - actor_first;
    let actions = action * hidden.first().copied().unwrap_or(1);
    2 * BATCH * (targets + learned + 2 * critic - critic_first + actions)
}
