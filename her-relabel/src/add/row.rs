//! A state and a step as the recorder takes them: slices of any element types, with their checks.

use crate::add::arguments::{FieldRows, StartData, StepData};
use crate::add::check::{AddError, check_finite, check_len, check_rewards};
use crate::scalar::Scalar;
use crate::store::config::Dims;
use crate::store::fields::Fields;

/// The first state of an episode, and the episode's goal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StartRow<'a, O, G> {
    pub(crate) observation: &'a [O],
    pub(crate) achieved_goal: &'a [G],
    pub(crate) desired_goal: &'a [G],
}

/// A step, and the place of its numbers among the rows of the given fields.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepRow<'a, O, G, A> {
    pub(crate) action: &'a [A],
    pub(crate) reward: G,
    pub(crate) next_observation: &'a [O],
    pub(crate) next_achieved_goal: &'a [G],
    pub(crate) terminated: bool,
    pub(crate) truncated: bool,
    pub(crate) fields: &'a [FieldRows<'a, G>],
    pub(crate) at: usize,
}

impl<'a, S> StartData<'a, S> {
    pub(crate) fn row(&self) -> StartRow<'a, S, S> {
        let Self { observation, achieved_goal, desired_goal } = *self;
        StartRow { observation, achieved_goal, desired_goal }
    }
}

impl<'a, S: Copy, A> StepData<'a, S, A> {
    pub(crate) fn row(&self) -> StepRow<'a, S, S, A> {
        StepRow {
            action: self.action,
            reward: self.reward,
            next_observation: self.next_observation,
            next_achieved_goal: self.next_achieved_goal,
            terminated: self.terminated,
            truncated: self.truncated,
            fields: self.fields,
            at: 0,
        }
    }
}

// All checks apply to the values as rounded to the buffer's type `T`.

impl<O: Scalar, G: Scalar> StartRow<'_, O, G> {
    pub(crate) fn check_lens(&self, dims: Dims) -> Result<(), AddError> {
        check_len("observation", self.observation.len(), dims.observation)?;
        check_len("achieved_goal", self.achieved_goal.len(), dims.goal)?;
        check_len("desired_goal", self.desired_goal.len(), dims.goal)
    }

    pub(crate) fn check_numbers<T: Scalar>(&self) -> Result<(), AddError> {
        check_finite::<T, O>("observation", self.observation)?;
        check_finite::<T, G>("achieved_goal", self.achieved_goal)?;
        check_finite::<T, G>("desired_goal", self.desired_goal)
    }
}

impl<O: Scalar, G: Scalar, A: Scalar> StepRow<'_, O, G, A> {
    /// Checks the lengths of all but the fields.
    pub(crate) fn check_lens(&self, dims: Dims) -> Result<(), AddError> {
        check_len("action", self.action.len(), dims.action)?;
        check_len("next_observation", self.next_observation.len(), dims.observation)?;
        check_len("next_achieved_goal", self.next_achieved_goal.len(), dims.goal)
    }

    /// Checks the numbers, those of the fields included, whose lengths must have been checked.
    pub(crate) fn check_numbers<T: Scalar>(&self, fields: &Fields) -> Result<(), AddError> {
        check_finite::<T, A>("action", self.action)?;
        check_rewards("reward", &[self.reward])?;
        check_finite::<T, O>("next_observation", self.next_observation)?;
        check_finite::<T, G>("next_achieved_goal", self.next_achieved_goal)?;
        self.fields.iter().try_for_each(|(name, values)| {
            let len = fields.place(name)?.len();
            check_finite::<T, G>(name, &values[self.at * len..][..len])
        })
    }
}
