//! The contenders: sampling, adding, and the copying that sampling needs at least.

use std::{cell::RefCell, hint::black_box, mem, rc::Rc};

use goal_reward::DistanceReward;
use her_relabel::{
    Batch, ColumnsMut, GoalStrategy, HerBuffer, JoinedGoal, Normalizer, NormalizerConfig,
    Normalizers, Sampler, Scalar, UnitInterval,
};

use super::episodes::{DIMS, Episode, RecordedRows, STEPS, Stepper, full_buffer};
use crate::bench::interleaved::Contender;

/// The approximate number of rows drawn in a turn. The turn is as long as Stable-Baselines3's, and
/// several times longer than filling the caches with its own memory takes.
const ROWS: usize = 1 << 19;
const ADDED: usize = 1000 * STEPS;

/// A full buffer and the episodes that are added to it.
pub struct Table<T> {
    buffer: HerBuffer<T>,
    episodes: Vec<Episode<T>>,
}

/// The environments to which each of the contenders adds.
const ENV_OF_SAMPLING: usize = 0;
pub const ENV_OF_STEPS: usize = 1;
pub const ENVS_OF_STEPS_8: usize = 2;
const ENV_OF_FORMS: usize = 10;
const ENVS_OF_RECORDS: usize = 11;
/// The number of environments whose rows are recorded at once.
const RECORDED: usize = 8;
const NUM_ENVS: usize = ENVS_OF_RECORDS + RECORDED;

impl<T: Scalar> Table<T> {
    pub fn full(transitions: usize) -> anyhow::Result<Rc<RefCell<Self>>> {
        let episodes = Episode::all();
        let buffer = full_buffer(transitions, NUM_ENVS, &episodes)?;
        Ok(Rc::new(RefCell::new(Self { buffer, episodes })))
    }
}

/// Returns the sampler of all draws: k = 4 and future goals.
fn sampler(size: usize) -> Sampler {
    Sampler::new(size, GoalStrategy::Future, UnitInterval::from_k(4))
}

/// Draws batches of each size with k = 4, future goals and the sparse reward, all from one table,
/// and adds a step after each.
pub fn sampling<T: Scalar>(
    table: &Rc<RefCell<Table<T>>>,
    sizes: &[usize],
) -> impl Iterator<Item = (usize, impl Contender + use<T>)> {
    let stepper = Rc::new(RefCell::new(Stepper::new(ENV_OF_SAMPLING, 1)));
    sizes.iter().map(move |&size| {
        let (table, stepper) = (Rc::clone(table), Rc::clone(&stepper));
        (size, drawing(table, stepper, sampler(size), None, |_: &mut Batch<T>| {}))
    })
}

/// Draws batches, each followed by an added step, and does something with them.
fn drawing<T: Scalar, B: Scalar>(
    table: Rc<RefCell<Table<T>>>,
    stepper: Rc<RefCell<Stepper>>,
    sampler: Sampler,
    normalizers: Option<[Normalizer; 2]>,
    mut after: impl FnMut(&mut Batch<B>),
) -> impl Contender {
    let mut batch = Batch::<B>::new();
    let (size, reward, mut seed) = (sampler.batch_size(), DistanceReward::sparse(), 0);
    move || {
        let Table { buffer, episodes } = &mut *table.borrow_mut();
        let mut stepper = stepper.borrow_mut();
        for _ in 0..ROWS / size {
            let [observation, goal] = match &normalizers {
                Some([observation, goal]) => [Some(observation), Some(goal)],
                None => [None, None],
            };
            let (normalizers, columns) = (Normalizers { observation, goal }, ColumnsMut::default());
            sampler.sample_into(buffer, &reward, seed, &mut batch, normalizers, columns)?;
            after(&mut batch);
            black_box(&batch);
            stepper.step(buffer, episodes)?;
            seed += 1;
        }
        Ok(ROWS / size * size)
    }
}

/// Draws batches in the forms that networks take, by name: the cost beyond
/// [plain batches](sampling) is that of the form.
pub fn forms<T: Scalar>(
    table: &Rc<RefCell<Table<T>>>,
    size: usize,
) -> anyhow::Result<Vec<(&'static str, Box<dyn Contender>)>> {
    let stepper = Rc::new(RefCell::new(Stepper::new(ENV_OF_FORMS, 1)));
    let (plain, joined) = (sampler(size), sampler(size).with_joined_goal(JoinedGoal::Desired));
    let tenth = UnitInterval::new(0.1)?;
    let normalizers = normalizers(&table.borrow().episodes)?;
    let (table, stepper) = (|| Rc::clone(table), || Rc::clone(&stepper));
    let none = |_: &mut Batch<T>| {};
    let mut inputs = [Vec::new(), Vec::new()];
    let mut copied = [Vec::new(), Vec::new()];
    let normalizers_after = normalizers.clone();
    Ok(vec![
        ("joined", Box::new(drawing(table(), stepper(), joined, None, none))),
        (
            "copied-and-joined",
            Box::new(drawing(table(), stepper(), plain, None, move |batch: &mut Batch<T>| {
                join(batch, &mut inputs);
                black_box(&inputs);
            })),
        ),
        ("f32", Box::new(drawing(table(), stepper(), plain, None, |_: &mut Batch<f32>| {}))),
        (
            "f32-joined",
            Box::new(drawing(table(), stepper(), joined, None, |_: &mut Batch<f32>| {})),
        ),
        (
            "f32-joined-normalized",
            Box::new(drawing(
                table(),
                stepper(),
                joined,
                Some(normalizers),
                |_: &mut Batch<f32>| {},
            )),
        ),
        (
            "f32-copied-joined-normalized",
            Box::new(drawing(table(), stepper(), plain, None, move |batch: &mut Batch<f32>| {
                let mut columns = batch.take_columns();
                let [observation, goal] = &normalizers_after;
                for column in [&mut columns.observation, &mut columns.next_observation] {
                    black_box(observation.normalize(column).is_ok());
                }
                black_box(goal.normalize(&mut columns.desired_goal).is_ok());
                join_columns(
                    [&columns.observation, &columns.next_observation],
                    &columns.desired_goal,
                    &mut copied,
                );
                black_box(&copied);
                batch.give_back(columns);
            })),
        ),
        (
            "achieved-left-out",
            Box::new(drawing(
                table(),
                stepper(),
                plain.with_keep_already_achieved(tenth),
                None,
                none,
            )),
        ),
    ])
}

/// Returns normalizers of observations and goals that have seen the episodes.
fn normalizers<T: Scalar>(episodes: &[Episode<T>]) -> anyhow::Result<[Normalizer; 2]> {
    let mut observation = Normalizer::new(NormalizerConfig::new(DIMS.observation))?;
    let mut goal = Normalizer::new(NormalizerConfig::new(DIMS.goal))?;
    for episode in episodes {
        let data = episode.data();
        observation.update(data.observation)?;
        goal.update(data.achieved_goal)?;
    }
    Ok([observation, goal])
}

/// Copies observations and goals into joined rows, as a learner without joined batches must.
fn join<T: Scalar>(batch: &Batch<T>, inputs: &mut [Vec<T>; 2]) {
    let observations = [batch.observation(), batch.next_observation()];
    join_columns(observations, batch.desired_goal(), inputs);
}

fn join_columns<T: Scalar>(observations: [&[T]; 2], goals: &[T], inputs: &mut [Vec<T>; 2]) {
    let width = DIMS.observation + DIMS.goal;
    for (observations, inputs) in observations.into_iter().zip(inputs) {
        inputs.resize(goals.len() / DIMS.goal * width, T::from_f64(0.0));
        let rows = observations.chunks_exact(DIMS.observation).zip(goals.chunks_exact(DIMS.goal));
        for (input, (observation, goal)) in inputs.chunks_exact_mut(width).zip(rows) {
            input[..DIMS.observation].copy_from_slice(observation);
            input[DIMS.observation..].copy_from_slice(goal);
        }
    }
}

/// Adds single steps to one environment, or to more.
pub fn add_steps<T: Scalar>(
    table: &Rc<RefCell<Table<T>>>,
    first_env: usize,
    num_envs: usize,
) -> impl Contender + use<T> {
    let (table, mut stepper) = (Rc::clone(table), Stepper::new(first_env, num_envs));
    move || {
        let Table { buffer, episodes } = &mut *table.borrow_mut();
        for _ in 0..ADDED {
            stepper.step(buffer, episodes)?;
        }
        Ok(ADDED)
    }
}

/// Records the rows of several environments at once; an episode ends and the next one begins in the
/// same step.
pub fn record<T: Scalar>(table: &Rc<RefCell<Table<T>>>) -> impl Contender + use<T> {
    let table = Rc::clone(table);
    let env_ids: Vec<usize> = (ENVS_OF_RECORDS..).take(RECORDED).collect();
    let (mut t, mut has_begun) = (0, false);
    move || {
        let Table { buffer, episodes } = &mut *table.borrow_mut();
        if !mem::replace(&mut has_begun, true) {
            for (env_index, episode) in env_ids.iter().zip(&*episodes) {
                buffer.begin_episode(*env_index, &episode.start())?;
            }
        }
        let rows = RecordedRows::new(&episodes[..RECORDED]);
        let mut recorded = 0;
        for _ in 0..ADDED / RECORDED {
            recorded += buffer.record(&rows.at(&env_ids, t))?.recorded_steps;
            t = (t + 1) % STEPS;
        }
        Ok(recorded)
    }
}

pub fn add_episodes<T: Scalar>(table: Rc<RefCell<Table<T>>>) -> impl Contender {
    move || {
        let Table { buffer, episodes } = &mut *table.borrow_mut();
        for episode in episodes.iter().cycle().take(ADDED / STEPS) {
            buffer.add_episode(&episode.data())?;
        }
        Ok(ADDED)
    }
}

/// The number of elements of a transition, with each state stored once.
const WIDTH: usize = DIMS.observation + DIMS.goal + DIMS.action + 1;
/// Number of rows whose cache lines are loaded together.
const BLOCK: usize = 32;

/// Copies only two neighboring rows and a goal near them from random places of a table as large as
/// the buffer's: the time that memory alone takes.
pub fn bare_gather<T: Scalar>(transitions: usize, batch_size: usize) -> impl Contender {
    let table = vec![T::from_f64(1.0); (transitions + STEPS) * WIDTH];
    let width = 2 * WIDTH + DIMS.goal;
    let mut out = vec![T::from_f64(0.0); batch_size * width];
    let goal_in_row = DIMS.observation + (STEPS / 2) * WIDTH;
    let mut random = 1_u64;
    let mut draw = move || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (((random >> 32) * transitions as u64) >> 32) as usize * WIDTH
    };
    move || {
        for _ in 0..ROWS / batch_size {
            for block in out.chunks_exact_mut(BLOCK * width) {
                let places: [usize; BLOCK] = std::array::from_fn(|_| draw());
                let touched = places.iter().map(|&place| {
                    let rows = &table[place..place + 2 * WIDTH];
                    let lines = rows.iter().step_by(64 / size_of::<T>());
                    lines.fold(table[place + goal_in_row].to_f64(), |sum, x| sum + x.to_f64())
                });
                black_box(touched.sum::<f64>());
                for (row, &place) in block.chunks_exact_mut(width).zip(&places) {
                    row[..2 * WIDTH].copy_from_slice(&table[place..place + 2 * WIDTH]);
                    let goal = &table[place + goal_in_row..][..DIMS.goal];
                    row[2 * WIDTH..].copy_from_slice(goal);
                }
            }
            black_box(&out);
        }
        Ok(ROWS / batch_size * batch_size)
    }
}
