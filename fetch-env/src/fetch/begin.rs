//! The beginning of an episode.

use fetch_sim::Simulator;
use goal_reward::GoalReward;

use super::env::FetchEnv;
use super::observation::{Goal, check_goal};
use super::reset::{FetchResetOptions, draw_object_position};
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
        let mut noise_seed = 0;
        self.varied = Varied::default();
        if !(variation.is_empty() && options.factors().is_empty()) {
            let mut side = random.jumped();
            noise_seed = side.seed();
            self.varied = Varied::draw(variation, options.factors(), &mut side)?;
        }
        let gripper = self.simulator.settled().gripper_position.xy().into();
        let draw = |range| draw_object_position(range, gripper, random);
        let drawn = self.config.object_range().map(draw);
        let object_position = options.object_position().or(drawn);
        self.simulator.reset_varied(object_position, &self.varied.physics)?;
        let mut goal = Goal::from_elem(0.0, self.lengths.goal);
        self.task.begin_episode(&self.config, &mut self.simulator, random, &mut goal)?;
        if !own.is_empty() {
            let numbers: Vec<_> = own.iter().map(|name| self.varied.own(name)).collect();
            self.task.vary(&mut self.simulator, &numbers, &mut goal)?;
        }
        self.interface.begin(self.varied.interface, noise_seed);
        if let Some(desired_goal) = options.desired_goal() {
            goal.copy_from_slice(desired_goal);
        }
        // A task may do anything with the simulator that it borrows, and write any goal.
        self.config.check_simulator(&self.simulator)?;
        check_goal(&goal)?;
        Ok(goal)
    }
}
