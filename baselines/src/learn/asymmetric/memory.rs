//! The states from which an actor that sees pictures learns.

use std::io::{self, Write};
use std::iter::successors;

use fetch_env::vec_env::{BatchObservation, VecStep};
use fetch_env::{GoalObservation, PictureRows};
use goal_reward::GoalReward;
use her_relabel::{Dims, Scalar, StateRows};
use rand::{Rng, RngExt};

use crate::learn::distill::frames::Frames;

/// How often a state may be drawn again.
const MAX_DRAWS: usize = 20;

/// The newest states with their pictures, each once: a row for each environment, decision after
/// decision.
pub(super) struct Memory {
    pub(super) frames: Frames,
    /// Whether an episode begins with each state.
    started: Vec<bool>,
    pub(super) num_envs: usize,
    /// The number of rows that fit.
    capacity: usize,
}

/// How goals are drawn, as [`ReplaySettings`](crate::learn::ReplaySettings) have it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goals {
    /// The probability of a goal that the episode achieves later.
    pub(super) relabeled: f64,
    /// The probability of keeping a state that has already achieved its goal.
    pub(super) keep_already_achieved: f64,
}

impl Memory {
    pub(super) fn new(capacity: usize, num_envs: usize) -> Self {
        let capacity = (capacity / num_envs).max(1) * num_envs;
        Self { frames: Frames::new(capacity), started: vec![false; capacity], num_envs, capacity }
    }

    /// Returns the states of a batch alone.
    pub(super) fn of<O, I>(batch: &VecStep<O, I>) -> Self
    where
        O: GoalObservation<Element: Scalar> + BatchObservation<Rows: AsRef<PictureRows>>,
    {
        let mut memory = Self::new(batch.len(), batch.len());
        memory.add(batch);
        memory
    }

    /// Adds the states of a batch.
    pub(super) fn add<O, I>(&mut self, batch: &VecStep<O, I>)
    where
        O: GoalObservation<Element: Scalar> + BatchObservation<Rows: AsRef<PictureRows>>,
    {
        let numbers = batch.observation().iter().map(|number| number.to_f64());
        // What failed has rows of other numbers; it then begins an episode.
        let finite = |number: f64| if number.is_finite() { number } else { 0.0 };
        let goals = |goals: &[f64]| goals.iter().map(|goal| finite(*goal)).collect::<Vec<_>>();
        let states = StateRows {
            observation: &numbers.map(finite).collect::<Vec<_>>(),
            achieved_goal: &goals(batch.achieved_goal()),
            desired_goal: &goals(batch.desired_goal()),
        };
        let started = batch.started().iter().enumerate();
        let started = started.map(|(env, started)| *started || batch.error(env).is_some());
        self.add_rows(&started.collect::<Vec<_>>(), batch.pixels(), &states);
    }

    /// Adds the states of a decision, in whose places an episode begins or not.
    fn add_rows(&mut self, started: &[bool], pictures: &[u8], states: &StateRows<'_, f64>) {
        let first = (self.frames.total % self.capacity as u64) as usize;
        self.started[first..][..self.num_envs].copy_from_slice(started);
        self.frames.add(self.num_envs, pictures, states, &[]);
    }

    /// Adds the states of another memory of as many environments, which has one decision.
    pub(super) fn append(&mut self, other: &Self) {
        self.add_rows(&other.started, &other.frames.pictures, &other.frames.states());
    }

    /// Returns the pictures and the states of the newest decision.
    pub(super) fn newest(&self) -> (&[u8], StateRows<'_, f64>) {
        let newest = self.newest_decision();
        let Frames { pictures, observation, achieved_goal, desired_goal, .. } = &self.frames;
        let states = StateRows {
            observation: self.of_decision(observation, newest),
            achieved_goal: self.of_decision(achieved_goal, newest),
            desired_goal: self.of_decision(desired_goal, newest),
        };
        (self.of_decision(pictures, newest), states)
    }

    /// Writes everything.
    pub(super) fn write_to(&self, to: &mut dyn Write) -> io::Result<()> {
        let started = &self.started[..self.frames.len()];
        to.write_all(&started.iter().map(|started| u8::from(*started)).collect::<Vec<_>>())?;
        self.frames.write_to(to)
    }

    /// Replaces everything by `total` states, as [`Frames::read`] does.
    pub(super) fn read<'a>(
        &mut self,
        total: u64,
        picture_len: usize,
        dims: Dims,
        bytes: &'a [u8],
    ) -> Option<&'a [u8]> {
        let rows = self.capacity.min(usize::try_from(total).unwrap_or(usize::MAX));
        let (started, rest) =
            bytes.split_at_checked(rows).filter(|_| rows.is_multiple_of(self.num_envs))?;
        let rest = self.frames.read(total, picture_len, dims, rest)?;
        self.started.iter_mut().zip(started).for_each(|(own, started)| *own = *started > 0);
        Some(rest)
    }

    /// Replaces `batch` by drawn states, whose goals are their own or, with the probability of
    /// hindsight, one that their episode achieves later.
    pub(super) fn draw(
        &self,
        goals: Goals,
        batch_size: usize,
        reward: &dyn GoalReward,
        rng: &mut impl Rng,
        batch: &mut Frames,
    ) {
        let len = self.frames.len();
        let (mut rows, mut desired_goals) = (Vec::new(), Vec::new());
        for _ in 0..batch_size {
            let mut number = 1;
            let (row, goal) = loop {
                let row = rng.random_range(0..len);
                let later = self.later(row).count();
                let is_relabeled = rng.random::<f64>() < goals.relabeled && later > 0;
                let later = is_relabeled.then(|| self.later(row).nth(rng.random_range(0..later)));
                let goal = match later.flatten() {
                    Some(later) => self.goal_of(&self.frames.achieved_goal, later),
                    None => self.goal_of(&self.frames.desired_goal, row),
                };
                let achieved = self.goal_of(&self.frames.achieved_goal, row);
                if number == MAX_DRAWS
                    || !reward.is_success(achieved, goal)
                    || rng.random::<f64>() < goals.keep_already_achieved
                {
                    break (row, goal);
                }
                number += 1;
            };
            rows.push(row);
            desired_goals.extend_from_slice(goal);
        }
        batch.gather(&self.frames, &rows);
        batch.desired_goal = desired_goals;
    }

    /// Returns the later rows of a row's episode.
    fn later(&self, row: usize) -> impl Iterator<Item = usize> + '_ {
        let newest = self.newest_decision();
        let next = move |row: &usize| {
            let next = (row + self.num_envs) % self.capacity;
            (row / self.num_envs != newest && !self.started[next]).then_some(next)
        };
        successors(Some(row), next).skip(1)
    }

    /// Returns the place of the newest decision.
    fn newest_decision(&self) -> usize {
        (self.frames.total.saturating_sub(1) % self.capacity as u64) as usize / self.num_envs
    }

    /// Returns the rows of a decision.
    fn of_decision<'a, T>(&self, rows: &'a [T], decision: usize) -> &'a [T] {
        let len = rows.len() / self.frames.len() * self.num_envs;
        &rows[decision * len..][..len]
    }

    /// Returns a row of goals.
    fn goal_of<'a>(&self, goals: &'a [f64], row: usize) -> &'a [f64] {
        let len = goals.len() / self.frames.len();
        &goals[row * len..][..len]
    }
}

#[cfg(test)]
mod tests {
    use goal_reward::DistanceReward;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Two environments whose goals are numbered by the decision; the first one's episodes begin
    /// with every third decision, the second one's with every fifth.
    fn memory(decisions: u32, capacity: usize) -> Memory {
        let mut memory = Memory::new(capacity, 2);
        for decision in 0..decisions {
            let started = [decision.is_multiple_of(3), decision.is_multiple_of(5)];
            let states = StateRows {
                observation: &[f64::from(decision), f64::from(decision)],
                achieved_goal: &[f64::from(decision), f64::from(decision) + 100.0],
                desired_goal: &[-1.0, -2.0],
            };
            memory.add_rows(&started, &[0; 2], &states);
        }
        memory
    }

    fn draw(memory: &Memory, relabeled: f64, keep_already_achieved: f64) -> Frames {
        let mut batch = Frames::new(200);
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let goals = Goals { relabeled, keep_already_achieved };
        memory.draw(goals, 200, &DistanceReward::sparse(), &mut rng, &mut batch);
        batch
    }

    #[test]
    fn a_goal_in_hindsight_is_one_that_the_same_episode_achieves_later() {
        // Ten decisions fit: those from 3 to 12, of which the third is in the fourth place.
        for (decisions, oldest, newest) in [(7, 0, 6), (13, 3, 12)] {
            let memory = memory(decisions, 21);
            let own = draw(&memory, 0.0, 1.0);
            assert!(own.desired_goal.iter().all(|goal| *goal < 0.0));
            let batch = draw(&memory, 1.0, 1.0);
            let (mut relabeled, mut last) = (0, 0);
            for (achieved, desired) in batch.achieved_goal.iter().zip(&batch.desired_goal) {
                let (env, length) = if *achieved < 100.0 { (0.0, 3) } else { (100.0, 5) };
                let decision = (achieved - env) as i32;
                assert!((oldest..=newest).contains(&decision));
                let end = (decision / length * length + length - 1).min(newest);
                if decision == end {
                    assert!(*desired < 0.0);
                    last += 1;
                } else {
                    let later = (desired - env) as i32;
                    assert!((decision + 1..=end).contains(&later), "{achieved} {desired}");
                    relabeled += 1;
                }
            }
            assert!(relabeled > 50 && last > 30, "{relabeled} {last}");
        }
    }

    #[test]
    fn a_state_that_has_achieved_its_goal_is_drawn_again() {
        let mut memory = memory(9, 100);
        // Half of the states have.
        memory.frames.desired_goal.iter_mut().step_by(2).for_each(|goal| *goal = 4.0);
        memory.frames.achieved_goal.iter_mut().step_by(2).for_each(|goal| *goal = 4.0);
        let achieved = |keep| {
            let batch = draw(&memory, 0.0, keep);
            batch.desired_goal.iter().filter(|goal| **goal == 4.0).count()
        };
        assert_eq!(achieved(0.0), 0);
        assert!((70..130).contains(&achieved(1.0)));
    }
}
