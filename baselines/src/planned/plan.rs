//! A plan, and the policy that plays it.

use std::cmp::Ordering;

use fetch_env::{BoxSpace, EnvError, GoalEnv, GoalObservation, Space, spaces::ArrayElement};
use serde::{Deserialize, Serialize};

use crate::evaluate::{Episode, Event, finish_episode};
use crate::policy::{Policy, PolicyError};

/// The actions from a state to the end of the episode, and their result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// An action for each step.
    pub actions: Vec<Vec<f32>>,
    /// Return, length, final distance and success from the state on.
    pub episode: Episode,
    /// The number of steps after which the goal is achieved for good; `None` if it is not achieved
    /// at the last step.
    pub steps_to_goal: Option<usize>,
    /// The achieved goal after the last step, in its unit: meters in the Fetch tasks.
    pub achieved_goal: Vec<f64>,
    /// The number of episodes that were simulated to find the plan.
    pub rollouts: usize,
}

impl Plan {
    /// Records what a policy does from an environment's state to the end of the episode.
    /// `observation` is the observation of that state.
    ///
    /// ```
    /// use baselines::{Plan, PlannedPolicy, ScriptedPolicy};
    /// use fetch_env::{Env, Task, make_kinematic};
    ///
    /// let mut env = make_kinematic("FetchReach-v4")?;
    /// let start = env.reset(Some(7))?.observation;
    /// let plan = Plan::record(&mut env, &start, &mut ScriptedPolicy::new(Task::Reach))?;
    /// env.reset(Some(7))?;
    /// let mut policy = PlannedPolicy::new(plan.actions.clone());
    /// assert_eq!(Plan::record(&mut env, &start, &mut policy)?, plan);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The environment's, and [`EnvError::Endless`] if the episode has not ended after 100,000
    /// steps.
    pub fn record<E: GoalEnv<ActionSpace = BoxSpace<f32>>>(
        env: &mut E,
        observation: &E::Observation,
        policy: &mut (impl Policy<E::Observation> + ?Sized),
    ) -> Result<Self, EnvError> {
        policy.reset();
        let mut actions = Vec::new();
        let mut steps_to_goal = None;
        let mut achieved_goal = Vec::new();
        let episode = finish_episode(
            env,
            policy,
            observation.clone(),
            None,
            |error| error,
            |_, event| {
                if let Event::Step(action, step) = event {
                    actions.push(action.to_vec());
                    let is_success = step.info.as_ref().is_success;
                    steps_to_goal = is_success.then(|| steps_to_goal.unwrap_or(actions.len()));
                    achieved_goal.clear();
                    achieved_goal.extend_from_slice(step.observation.achieved_goal());
                }
                Ok(())
            },
        )?;
        Ok(Self { actions, episode, steps_to_goal, achieved_goal, rollouts: 1 })
    }

    /// Orders plans from the best to the worst: first those that end in success, by the step at
    /// which they achieve the goal for good, then the others; ties by their final distance. One
    /// that is no number is the farthest.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        let steps = |plan: &Self| plan.steps_to_goal.unwrap_or(usize::MAX);
        let distance = |plan: &Self| match plan.episode.final_distance {
            distance if distance.is_nan() => f64::INFINITY,
            distance => distance,
        };
        steps(self).cmp(&steps(other)).then(distance(self).total_cmp(&distance(other)))
    }
}

/// A policy that plays the actions of a [`Plan`], one after another, whatever it observes.
///
/// From the state that they were planned for, in an environment made the same way, they have the
/// same result, bit for bit; from any other state they mean nothing. After the last one, all
/// actions are 0, like those of a [`ZeroPolicy`](crate::ZeroPolicy).
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPolicy {
    actions: Vec<Vec<f32>>,
    /// The number of actions that were played.
    played: usize,
}

impl PlannedPolicy {
    /// Returns the policy that plays these actions.
    #[must_use]
    pub const fn new(actions: Vec<Vec<f32>>) -> Self {
        Self { actions, played: 0 }
    }
}

impl<O> Policy<O> for PlannedPolicy {
    fn check_spaces(
        &self,
        _observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        // Actions of other elements have no `f32`.
        let expected = f32::len_in(action_space).unwrap_or(0);
        match self.actions.iter().map(Vec::len).find(|actual| *actual != expected) {
            None => Ok(()),
            Some(actual) => Err(PolicyError::Planned { expected, actual }),
        }
    }

    fn reset(&mut self) {
        self.played = 0;
    }

    fn act(&mut self, _observation: &O, action: &mut [f32]) {
        action.fill(0.0);
        if let Some(planned) = self.actions.get(self.played) {
            for (element, planned) in action.iter_mut().zip(planned) {
                *element = *planned;
            }
            self.played += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distance_that_is_no_number_is_the_farthest() {
        let plan = |final_distance| Plan {
            actions: Vec::new(),
            episode: Episode { final_distance, ..Episode::new(None) },
            steps_to_goal: None,
            achieved_goal: Vec::new(),
            rollouts: 1,
        };
        // 0 / 0 has either sign, depending on the processor.
        for nan in [f64::NAN, -f64::NAN] {
            for distance in [0.0, 1.0, f64::MAX] {
                assert_eq!(plan(distance).order(&plan(nan)), Ordering::Less, "{distance}");
                assert_eq!(plan(nan).order(&plan(distance)), Ordering::Greater, "{distance}");
            }
            assert_eq!(plan(nan).order(&plan(-nan)), Ordering::Equal);
        }
    }
}
