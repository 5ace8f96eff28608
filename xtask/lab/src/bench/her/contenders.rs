//! The contenders: sampling, adding, and the copy that sampling needs at least.

use std::{cell::RefCell, hint::black_box, rc::Rc};

use goal_reward::DistanceReward;
use her_relabel::{Batch, GoalStrategy, HerBuffer, Sampler, Scalar, UnitInterval};

use super::episodes::{DIMS, Episode, STEPS, Stepper, full_buffer};
use crate::bench::interleaved::Contender;

/// About the number of rows drawn in a turn. The turn is as long as Stable-Baselines3's, and several
/// times longer than it takes to fill the caches with its own memory.
const ROWS: usize = 1 << 19;
/// Transitions added in a turn.
const ADDED: usize = 1000 * STEPS;

/// A full buffer and the episodes that are added to it.
pub struct Table<T> {
    buffer: HerBuffer<T>,
    episodes: Vec<Episode<T>>,
}

/// The environments to which each of the contenders adds.
const ENV_OF_SAMPLING: usize = 0;
const ENV_OF_STEPS: usize = 1;
const ENVS_OF_STEPS_8: usize = 2;
const NUM_ENVS: usize = 10;

impl<T: Scalar> Table<T> {
    pub fn full(transitions: usize) -> anyhow::Result<Rc<RefCell<Self>>> {
        let episodes = Episode::all();
        let buffer = full_buffer(transitions, NUM_ENVS, &episodes)?;
        Ok(Rc::new(RefCell::new(Self { buffer, episodes })))
    }
}

/// Draws batches with k = 4, future goals and the sparse reward, and adds a step after each.
pub struct Sampling<T> {
    table: Rc<RefCell<Table<T>>>,
    sampler: Sampler,
    batch: Batch<T>,
    stepper: Rc<RefCell<Stepper>>,
    seed: u64,
}

impl<T: Scalar> Sampling<T> {
    /// Returns one contender for each batch size, all on one table.
    pub fn of_sizes(
        table: &Rc<RefCell<Table<T>>>,
        sizes: &[usize],
    ) -> impl Iterator<Item = (usize, Self)> {
        let stepper = Rc::new(RefCell::new(Stepper::new(ENV_OF_SAMPLING, 1)));
        sizes.iter().map(move |&size| {
            let sampler = Sampler::new(size, GoalStrategy::Future, UnitInterval::from_k(4));
            let (table, stepper) = (Rc::clone(table), Rc::clone(&stepper));
            (size, Self { table, sampler, batch: Batch::new(), stepper, seed: 0 })
        })
    }
}

impl<T: Scalar> Contender for Sampling<T> {
    fn work(&mut self) -> anyhow::Result<usize> {
        let Table { buffer, episodes } = &mut *self.table.borrow_mut();
        let mut stepper = self.stepper.borrow_mut();
        let size = self.sampler.batch_size();
        let reward = DistanceReward::sparse();
        for _ in 0..ROWS / size {
            self.sampler.sample(buffer, &reward, self.seed, &mut self.batch)?;
            black_box(&self.batch);
            stepper.step(buffer, episodes)?;
            self.seed += 1;
        }
        Ok(ROWS / size * size)
    }
}

/// Adds single steps.
pub struct AddSteps<T> {
    table: Rc<RefCell<Table<T>>>,
    stepper: Stepper,
}

impl<T> AddSteps<T> {
    pub fn of_one_env(table: &Rc<RefCell<Table<T>>>) -> Self {
        Self { table: Rc::clone(table), stepper: Stepper::new(ENV_OF_STEPS, 1) }
    }

    pub fn of_8_envs(table: &Rc<RefCell<Table<T>>>) -> Self {
        Self { table: Rc::clone(table), stepper: Stepper::new(ENVS_OF_STEPS_8, 8) }
    }
}

impl<T: Scalar> Contender for AddSteps<T> {
    fn work(&mut self) -> anyhow::Result<usize> {
        let Table { buffer, episodes } = &mut *self.table.borrow_mut();
        for _ in 0..ADDED {
            self.stepper.step(buffer, episodes)?;
        }
        Ok(ADDED)
    }
}

/// Adds whole episodes.
pub struct AddEpisodes<T>(pub Rc<RefCell<Table<T>>>);

impl<T: Scalar> Contender for AddEpisodes<T> {
    fn work(&mut self) -> anyhow::Result<usize> {
        let Table { buffer, episodes } = &mut *self.0.borrow_mut();
        for episode in episodes.iter().cycle().take(ADDED / STEPS) {
            buffer.add_episode(&episode.data())?;
        }
        Ok(ADDED)
    }
}

/// Only copies two neighboring rows and a goal near them from random places of a table as large as the
/// buffer's: the time that memory alone takes.
pub struct BareGather<T> {
    table: Vec<T>,
    out: Vec<T>,
    batch_size: usize,
    random: u64,
}

/// The number of elements of a transition, with each state stored once.
const WIDTH: usize = DIMS.observation + DIMS.goal + DIMS.action + 1;
/// Number of rows whose cache lines are loaded together.
const BLOCK: usize = 32;

impl<T: Scalar> BareGather<T> {
    pub fn new(transitions: usize, batch_size: usize) -> Self {
        Self {
            table: vec![T::from_f64(1.0); (transitions + STEPS) * WIDTH],
            out: vec![T::from_f64(0.0); batch_size * (2 * WIDTH + DIMS.goal)],
            batch_size,
            random: 1,
        }
    }

    fn draw(&mut self) -> usize {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let places = (self.table.len() / WIDTH - STEPS) as u64;
        (((self.random >> 32) * places) >> 32) as usize * WIDTH
    }
}

impl<T: Scalar> Contender for BareGather<T> {
    fn work(&mut self) -> anyhow::Result<usize> {
        let goal_in_row = DIMS.observation + (STEPS / 2) * WIDTH;
        for _ in 0..ROWS / self.batch_size {
            for block in 0..self.batch_size / BLOCK {
                let places: [usize; BLOCK] = std::array::from_fn(|_| self.draw());
                let touched = places.iter().map(|&place| {
                    let rows = &self.table[place..place + 2 * WIDTH];
                    let lines = rows.iter().step_by(64 / size_of::<T>());
                    lines.fold(self.table[place + goal_in_row].to_f64(), |sum, x| sum + x.to_f64())
                });
                black_box(touched.sum::<f64>());
                for (row, &place) in places.iter().enumerate() {
                    let width = 2 * WIDTH + DIMS.goal;
                    let out = &mut self.out[(block * BLOCK + row) * width..][..width];
                    out[..2 * WIDTH].copy_from_slice(&self.table[place..place + 2 * WIDTH]);
                    let goal = &self.table[place + goal_in_row..][..DIMS.goal];
                    out[2 * WIDTH..].copy_from_slice(goal);
                }
            }
            black_box(&self.out);
        }
        Ok(ROWS / self.batch_size * self.batch_size)
    }
}
