//! The beginning of an episode.

use fetch_sim::Simulator;
use goal_reward::GoalReward;
use rand_core::Rng;

use super::env::FetchEnv;
use super::observation::{Goal, check_goal};
use super::reset::{FetchResetOptions, draw_object_position};
use super::start;
use super::task::FetchTask;
use super::variation::{Varied, check_factor};
use crate::gym::{error::EnvError, np_random::NpRandom};

impl<S: Simulator, R: GoalReward, T: FetchTask<S>> FetchEnv<S, R, T> {
    /// Draws a start and begins an episode there.
    pub(super) fn begin_episode(
        &mut self,
        options: &FetchResetOptions,
        random: &mut NpRandom,
    ) -> Result<Goal, EnvError> {
        let own = self.task.factors();
        let variation = self.config.variation();
        let mut factors =
            variation.iter().map(|(factor, _)| factor).chain(options.factors().keys());
        factors.try_for_each(|factor| check_factor(factor, &self.simulator, own))?;
        let (varied, noise_seed) = if variation.is_empty() && options.factors().is_empty() {
            (Varied::default(), 0)
        } else {
            // A task may draw nothing, and each episode must draw other numbers.
            let mut beside = random.beside(self.varied_episodes);
            self.varied_episodes = self.varied_episodes.wrapping_add(1);
            (Varied::draw(variation, options.factors(), &mut beside)?, beside.next_u64())
        };
        self.interface.begin(varied.interface, noise_seed);
        self.varied = varied;
        let gripper = self.simulator.settled().gripper_position.xy().into();
        let draw = |range| draw_object_position(range, gripper, random);
        let drawn = self.config.object_range().map(draw);
        let object_position = options.object_position().or(drawn);
        self.simulator.reset_varied(object_position, &self.varied.physics)?;
        start::arrange(&mut self.simulator, options)?;
        let mut goal = Goal::from_elem(0.0, self.lengths.goal);
        self.memory =
            self.task.begin_episode(&self.config, &mut self.simulator, random, &mut goal)?;
        if !own.is_empty() {
            let numbers: Vec<_> = own.iter().map(|name| self.varied.own(name)).collect();
            self.task.vary(&mut self.simulator, &numbers, &mut goal)?;
        }
        if let Some(desired_goal) = options.desired_goal() {
            goal.copy_from_slice(desired_goal);
        }
        // A task may do anything with the simulator that it borrows, and write any goal.
        self.config.check_simulator(&self.simulator)?;
        if self.simulator.physics() != self.varied.physics {
            return Err(EnvError::other(
                "the task has reset the simulator to the model's own physics: call reset_varied() \
                 with the simulator's physics(), or do not reset it",
            ));
        }
        check_goal(&goal)?;
        Ok(goal)
    }
}
