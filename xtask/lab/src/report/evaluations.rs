//! The evaluations and observations that the report's sections show.

use baselines::{Action, Evaluation, Policy, evaluate, page::Ink};
use fetch_env::{EnvId, FetchObservation, GoalObservation, Task, make_with_config};
use goal_reward::RewardKind;
use rayon::prelude::*;

use crate::shared::{
    choice::{PolicyChoice, flag_name},
    progress,
};

/// The results of one policy in one environment.
pub struct Outcome {
    pub id: EnvId,
    pub policy: PolicyChoice,
    pub evaluation: Evaluation,
    pub ranges: Ranges,
}

impl Outcome {
    fn of(id: EnvId, policy: PolicyChoice, episodes: usize, seed: u64) -> anyhow::Result<Self> {
        let mut watched =
            Watched { policy: policy.policy(id.task, seed), ranges: Ranges::default() };
        let evaluation =
            evaluate(&mut make_with_config(id.config())?, &mut watched, episodes, seed, |_| ())?;
        Ok(Self { id, policy, evaluation, ranges: watched.ranges })
    }

    /// The color of the policy in all plots.
    pub fn ink(&self) -> Ink {
        if self.policy == PolicyChoice::Random { Ink::Orange } else { Ink::Blue }
    }
}

/// Evaluates the random policy in all eight environments, the scripted one in those with dense reward.
pub fn evaluate_all(episodes: usize, seed: u64) -> anyhow::Result<Vec<Outcome>> {
    let random = EnvId::ALL.map(|id| (id, PolicyChoice::Random));
    let scripted =
        Task::ALL.map(|task| (EnvId { task, reward: RewardKind::Dense }, PolicyChoice::Scripted));
    let all: Vec<_> = random.into_iter().chain(scripted).collect();
    let bar = progress::bar(all.len(), "baselines");
    let outcomes = all
        .into_par_iter()
        .map(|(id, policy)| {
            let outcome = Outcome::of(id, policy, episodes, seed)?;
            bar.inc(1);
            progress::note(&bar, format_args!("evaluated {id}, {} policy", flag_name(policy)));
            Ok(outcome)
        })
        .collect();
    bar.finish_and_clear();
    outcomes
}

/// The least and the greatest value of each element: observation, achieved goal, desired goal.
#[derive(Clone, Debug, Default)]
pub struct Ranges(pub Vec<(f64, f64)>);

impl Ranges {
    fn of(o: &FetchObservation) -> Self {
        let values = o.observation().iter().chain(o.achieved_goal()).chain(o.desired_goal());
        Self(values.map(|&value| (value, value)).collect())
    }

    /// Widens the ranges to hold others.
    pub fn include(&mut self, others: &Self) {
        self.0.resize(others.0.len(), (f64::INFINITY, f64::NEG_INFINITY));
        for (range, other) in self.0.iter_mut().zip(&others.0) {
            *range = (range.0.min(other.0), range.1.max(other.1));
        }
    }
}

/// A policy that records the ranges of its observations: all but the last of each episode.
struct Watched {
    policy: Box<dyn Policy>,
    ranges: Ranges,
}

impl Policy for Watched {
    fn reset(&mut self) {
        self.policy.reset();
    }

    fn act(&mut self, observation: &FetchObservation) -> Action {
        self.ranges.include(&Ranges::of(observation));
        self.policy.act(observation)
    }
}
