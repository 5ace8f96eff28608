//! Teachers that act on one environment at a time.

use std::fmt;

use fetch_env::vec_env::{BatchObservation, GoalRows, VecStep};
use fetch_env::{GoalObservation, Space};
use her_relabel::Scalar;

use crate::policy::{Policy, PolicyError, VecPolicy};

/// A policy for each of many environments, which together choose the actions of all: for a policy
/// that remembers something of its episode, such as [`ScriptedPolicy`](crate::ScriptedPolicy).
#[derive(Clone)]
pub struct EachEnv<P>(Vec<P>);

impl<P> EachEnv<P> {
    /// Returns a policy that is a clone of `policy` in each of `num_envs` environments. In more of them
    /// than these, its actions are NaN, which environments and a [`Distiller`](crate::learn::Distiller)
    /// refuse.
    #[must_use]
    pub fn new(policy: P, num_envs: usize) -> Self
    where
        P: Clone,
    {
        Self(vec![policy; num_envs])
    }
}

impl<P> fmt::Debug for EachEnv<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("EachEnv").field(&self.0.len()).finish()
    }
}

/// The state of one environment, as a row of a [`VecStep`] has it.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvState {
    observation: Vec<f64>,
    achieved_goal: Vec<f64>,
    desired_goal: Vec<f64>,
}

impl BatchObservation for EnvState {
    type Rows = GoalRows<f64>;
}

impl GoalObservation for EnvState {
    type Element = f64;

    fn observation(&self) -> &[f64] {
        &self.observation
    }

    fn achieved_goal(&self) -> &[f64] {
        &self.achieved_goal
    }

    fn desired_goal(&self) -> &[f64] {
        &self.desired_goal
    }
}

impl<O: GoalObservation<Element: Scalar>, I, P: Policy<EnvState>> VecPolicy<O, I> for EachEnv<P> {
    fn check_spaces(&self, observation: &Space, action: &Space) -> Result<(), PolicyError> {
        self.0.iter().try_for_each(|policy| policy.check_spaces(observation, action))
    }

    fn reset_all(&mut self) {
        self.0.iter_mut().for_each(Policy::reset);
    }

    fn act_all(&mut self, batch: &VecStep<O, I>, actions: &mut [f32]) {
        let rows = batch.len().max(1);
        let len = |all: usize, row: usize| row * (all / rows)..(row + 1) * (all / rows);
        // An environment without a policy of its own has no action.
        actions.fill(f32::NAN);
        for (row, policy) in self.0.iter_mut().enumerate().take(batch.len()) {
            if batch.started()[row] {
                policy.reset();
            }
            let part = |all: &[f64]| all[len(all.len(), row)].to_vec();
            let observation = &batch.observation()[len(batch.observation().len(), row)];
            let state = EnvState {
                observation: observation.iter().map(|number| number.to_f64()).collect(),
                achieved_goal: part(batch.achieved_goal()),
                desired_goal: part(batch.desired_goal()),
            };
            let action = len(actions.len(), row);
            policy.act(&state, &mut actions[action]);
        }
    }
}
