//! Views of the rows of a batch, to be written part by part.

use crate::store::config::Dims;
use crate::store::storage::TransitionId;

/// Mutable views of some consecutive rows of a batch, and of the scratch memory that belongs to them.
pub(crate) struct Rows<'a, T> {
    pub(crate) dims: Dims,
    /// How many pairs of goals a row may need.
    pub(crate) window: usize,
    /// The place of the first row in the batch.
    pub(crate) first: usize,
    pub(crate) observation: &'a mut [T],
    pub(crate) achieved_goal: &'a mut [T],
    pub(crate) desired_goal: &'a mut [T],
    pub(crate) action: &'a mut [T],
    pub(crate) reward: &'a mut [T],
    pub(crate) next_observation: &'a mut [T],
    pub(crate) next_achieved_goal: &'a mut [T],
    pub(crate) terminated: &'a mut [bool],
    pub(crate) truncated: &'a mut [bool],
    pub(crate) discount: &'a mut [T],
    pub(crate) transition: &'a mut [TransitionId],
    pub(crate) goal_source: &'a mut [Option<TransitionId>],
    pub(crate) relabeled: &'a mut [Relabeled],
    pub(crate) achieved_pairs: &'a mut [f64],
    pub(crate) desired_pairs: &'a mut [f64],
    /// All fields, row by row.
    pub(crate) fields: &'a mut [T],
}

/// A relabeled row of a batch, and its window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Relabeled {
    pub(crate) row: usize,
    /// How many pairs of goals it has: one for each step of the window.
    pub(crate) pairs: usize,
    /// How many of the steps are used, which may be fewer if the new goal ends the task.
    pub(crate) used: usize,
}

impl<T> Rows<'_, T> {
    pub(crate) fn len(&self) -> usize {
        self.transition.len()
    }

    /// The first `rows` rows and the others.
    pub(crate) fn split_at(&mut self, rows: usize) -> (Rows<'_, T>, Rows<'_, T>) {
        let Dims { observation, goal, action } = self.dims;
        let pair = goal * self.window;
        let fields = self.fields.len() / self.len().max(1);
        let observations = self.observation.split_at_mut(rows * observation);
        let achieved_goals = self.achieved_goal.split_at_mut(rows * goal);
        let desired_goals = self.desired_goal.split_at_mut(rows * goal);
        let actions = self.action.split_at_mut(rows * action);
        let rewards = self.reward.split_at_mut(rows);
        let next_observations = self.next_observation.split_at_mut(rows * observation);
        let next_achieved_goals = self.next_achieved_goal.split_at_mut(rows * goal);
        let terminated = self.terminated.split_at_mut(rows);
        let truncated = self.truncated.split_at_mut(rows);
        // Empty unless the batch has windows.
        let discounts = self.discount.split_at_mut(rows.min(self.discount.len()));
        let transitions = self.transition.split_at_mut(rows);
        let goal_sources = self.goal_source.split_at_mut(rows);
        let relabeled = self.relabeled.split_at_mut(rows);
        let achieved_pairs = self.achieved_pairs.split_at_mut(rows * pair);
        let desired_pairs = self.desired_pairs.split_at_mut(rows * pair);
        let fields = self.fields.split_at_mut(rows * fields);
        let front = Rows {
            dims: self.dims,
            window: self.window,
            first: self.first,
            observation: observations.0,
            achieved_goal: achieved_goals.0,
            desired_goal: desired_goals.0,
            action: actions.0,
            reward: rewards.0,
            next_observation: next_observations.0,
            next_achieved_goal: next_achieved_goals.0,
            terminated: terminated.0,
            truncated: truncated.0,
            discount: discounts.0,
            transition: transitions.0,
            goal_source: goal_sources.0,
            relabeled: relabeled.0,
            achieved_pairs: achieved_pairs.0,
            desired_pairs: desired_pairs.0,
            fields: fields.0,
        };
        let back = Rows {
            dims: self.dims,
            window: self.window,
            first: self.first + rows,
            observation: observations.1,
            achieved_goal: achieved_goals.1,
            desired_goal: desired_goals.1,
            action: actions.1,
            reward: rewards.1,
            next_observation: next_observations.1,
            next_achieved_goal: next_achieved_goals.1,
            terminated: terminated.1,
            truncated: truncated.1,
            discount: discounts.1,
            transition: transitions.1,
            goal_source: goal_sources.1,
            relabeled: relabeled.1,
            achieved_pairs: achieved_pairs.1,
            desired_pairs: desired_pairs.1,
            fields: fields.1,
        };
        (front, back)
    }
}
