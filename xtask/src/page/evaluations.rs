//! What the page's figures are made from: the baselines, evaluated, and what they observed.

use baselines::{Action, Evaluation, Policy, evaluate};
use fetch_env::{EnvId, FetchObservation, GoalObservation, make_with_config};

use crate::policy_choice::PolicyChoice;

/// One policy in one environment.
pub struct Outcome {
    pub id: EnvId,
    pub policy: PolicyChoice,
    pub evaluation: Evaluation,
    pub ranges: Ranges,
}

impl Outcome {
    pub fn of(id: EnvId, policy: PolicyChoice, episodes: usize, seed: u64) -> anyhow::Result<Self> {
        let mut watched =
            Watched { policy: policy.policy(id.task, seed), ranges: Ranges::default() };
        let evaluation =
            evaluate(&mut make_with_config(id.config())?, &mut watched, episodes, seed, |_| ())?;
        Ok(Self { id, policy, evaluation, ranges: watched.ranges })
    }
}

/// The least and the greatest value of each element that was observed.
#[derive(Clone, Debug, Default)]
pub struct Ranges {
    pub observation: Vec<(f64, f64)>,
    pub achieved_goal: Vec<(f64, f64)>,
    pub desired_goal: Vec<(f64, f64)>,
}

impl Ranges {
    /// Widens the ranges to hold an observation.
    fn include(&mut self, observation: &FetchObservation) {
        widen(&mut self.observation, observation.observation().iter().map(|&v| (v, v)));
        widen(&mut self.achieved_goal, observation.achieved_goal().iter().map(|&v| (v, v)));
        widen(&mut self.desired_goal, observation.desired_goal().iter().map(|&v| (v, v)));
    }

    /// The ranges that hold both.
    pub fn union(mut self, other: &Self) -> Self {
        widen(&mut self.observation, other.observation.iter().copied());
        widen(&mut self.achieved_goal, other.achieved_goal.iter().copied());
        widen(&mut self.desired_goal, other.desired_goal.iter().copied());
        self
    }
}

fn widen(ranges: &mut Vec<(f64, f64)>, others: impl ExactSizeIterator<Item = (f64, f64)>) {
    ranges.resize(others.len(), (f64::INFINITY, f64::NEG_INFINITY));
    for (range, other) in ranges.iter_mut().zip(others) {
        *range = (range.0.min(other.0), range.1.max(other.1));
    }
}

/// A policy that remembers the ranges of what it was shown: every observation but the last of each
/// episode.
struct Watched {
    policy: Box<dyn Policy>,
    ranges: Ranges,
}

impl Policy for Watched {
    fn reset(&mut self) {
        self.policy.reset();
    }

    fn act(&mut self, observation: &FetchObservation) -> Action {
        self.ranges.include(observation);
        self.policy.act(observation)
    }
}
