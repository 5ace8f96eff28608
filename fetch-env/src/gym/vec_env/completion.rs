//! Results that are computed for all environments together.

use goal_reward::goal_distance;

use super::config::AutoresetMode;
use super::env::VecEnv;
use super::error::VecEnvError;
use super::step::VecStep;
use crate::gym::env::action_space::ActionSpace;
use crate::gym::env::goal::{GoalEnv, Info};
use crate::gym::env::observation::{BatchObservation, GoalObservation, GoalRows};

/// Results of all environments, row after row, which replace those of a [`VecEnv`]'s last call.
#[derive(Clone, Copy, Debug)]
pub struct Completion<'a> {
    /// The goals that the states achieve.
    pub achieved_goal: &'a [f64],
    /// The last elements of the observations; none to leave them as they are.
    pub extra: &'a [f64],
    /// The rewards of the steps; those of rows that took none mean nothing.
    pub reward: &'a [f64],
    /// Whether the achieved goals count as the desired ones.
    pub success: &'a [bool],
    /// Which rows are replaced.
    pub rows: &'a [bool],
}

impl Completion<'_> {
    fn check(
        &self,
        num_envs: usize,
        [observation_len, goal_len]: [usize; 2],
    ) -> Result<(), VecEnvError> {
        let extra_len = (self.extra.len() / num_envs).min(observation_len);
        for (what, actual, len) in [
            ("achieved_goal", self.achieved_goal.len(), goal_len),
            ("extra", self.extra.len(), extra_len),
            ("reward", self.reward.len(), 1),
            ("success", self.success.len(), 1),
            ("rows", self.rows.len(), 1),
        ] {
            if actual != num_envs * len {
                return Err(VecEnvError::Count { what, actual, num_envs });
            }
        }
        Ok(())
    }
}

impl<E> VecEnv<E>
where
    E: GoalEnv<Info = Info> + Send + 'static,
    E::Observation: BatchObservation<Rows = GoalRows<f64>> + GoalObservation<Element = f64>,
    E::ActionSpace: ActionSpace,
{
    /// Replaces the achieved goals, the ends of the observations, the rewards and the infos of the
    /// last call: for tasks that cost less for all environments together, such as those of another
    /// language. The environments themselves return anything in their places. Snapshots, and whether
    /// episodes end, do not depend on it.
    ///
    /// # Errors
    /// [`VecEnvError::InFlight`], [`VecEnvError::Count`] for a slice of another length, and
    /// [`VecEnvError::Begun`] with [`AutoresetMode::SameStep`], which leaves the last states.
    pub fn complete(&mut self, completion: &Completion<'_>) -> Result<(), VecEnvError> {
        self.check_all_idle()?;
        if self.autoreset == AutoresetMode::SameStep {
            return Err(VecEnvError::Begun);
        }
        let num_envs = self.num_envs();
        let lens = [self.step.observation().len(), self.step.desired_goal().len()];
        completion.check(num_envs, lens.map(|len| len / num_envs))?;
        for slot in self.idle.iter_mut().flatten().filter(|slot| completion.rows[slot.env_index]) {
            let env_index = slot.env_index;
            let stepped = self.step.stepped()[env_index];
            // The vector's row, and the environment's own, which a later call may show again.
            self.step.complete(env_index, completion, env_index, stepped);
            slot.row.complete(0, completion, env_index, stepped);
        }
        Ok(())
    }
}

impl<O: BatchObservation<Rows = GoalRows<f64>>, A> VecStep<O, Info, A> {
    fn complete(&mut self, row: usize, from: &Completion<'_>, from_row: usize, stepped: bool) {
        let num_envs = from.reward.len();
        let part = |numbers: &'_ [f64]| {
            let len = numbers.len() / num_envs;
            from_row * len..(from_row + 1) * len
        };
        let achieved = &from.achieved_goal[part(from.achieved_goal)];
        self.observation.complete(row, achieved, &from.extra[part(from.extra)]);
        let goals = self.observation.desired_goal(row + 1);
        let desired = &goals[row * achieved.len()..];
        if let Some(info) = &mut self.info[row] {
            *info = Info::new(from.success[from_row], goal_distance(achieved, desired));
        }
        if stepped {
            self.reward[row] = from.reward[from_row];
        }
    }
}
