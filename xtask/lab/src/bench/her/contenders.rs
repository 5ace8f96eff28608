//! The contenders: sampling, adding, and the copy that sampling needs at least.

use std::{cell::RefCell, hint::black_box, rc::Rc};

use goal_reward::DistanceReward;
use her_relabel::{Batch, GoalStrategy, HerBuffer, Sampler, Scalar, UnitInterval};

use super::episodes::{DIMS, Episode, STEPS, Stepper, full_buffer};
use crate::bench::interleaved::Contender;

/// About the number of rows drawn in a turn. The turn is as long as Stable-Baselines3's, and several
/// times longer than it takes to fill the caches with its own memory.
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
const NUM_ENVS: usize = 10;

impl<T: Scalar> Table<T> {
    pub fn full(transitions: usize) -> anyhow::Result<Rc<RefCell<Self>>> {
        let episodes = Episode::all();
        let buffer = full_buffer(transitions, NUM_ENVS, &episodes)?;
        Ok(Rc::new(RefCell::new(Self { buffer, episodes })))
    }
}

/// Draws batches of each size with k = 4, future goals and the sparse reward, all from one table, and
/// adds a step after each.
pub fn sampling<T: Scalar>(
    table: &Rc<RefCell<Table<T>>>,
    sizes: &[usize],
) -> impl Iterator<Item = (usize, impl Contender + use<T>)> {
    let stepper = Rc::new(RefCell::new(Stepper::new(ENV_OF_SAMPLING, 1)));
    sizes.iter().map(move |&size| {
        let sampler = Sampler::new(size, GoalStrategy::Future, UnitInterval::from_k(4));
        let (table, stepper) = (Rc::clone(table), Rc::clone(&stepper));
        let (mut batch, mut seed) = (Batch::new(), 0);
        let reward = DistanceReward::sparse();
        let work = move || {
            let Table { buffer, episodes } = &mut *table.borrow_mut();
            let mut stepper = stepper.borrow_mut();
            for _ in 0..ROWS / size {
                sampler.sample(buffer, &reward, seed, &mut batch)?;
                black_box(&batch);
                stepper.step(buffer, episodes)?;
                seed += 1;
            }
            Ok(ROWS / size * size)
        };
        (size, work)
    })
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

/// Only copies two neighboring rows and a goal near them from random places of a table as large as the
/// buffer's: the time that memory alone takes.
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
