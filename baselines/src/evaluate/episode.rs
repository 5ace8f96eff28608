//! The result of one episode, and how it is measured.

use std::marker::PhantomData;

use fetch_env::{GoalObservation, Info, spaces::ArrayElement};
use serde::{Deserialize, Serialize};

/// The result of one episode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Episode {
    /// Seed of the reset; `None` if it continued the environment's random numbers.
    pub seed: Option<u64>,
    /// Sum of the rewards.
    pub episode_return: f64,
    /// Number of steps.
    pub episode_length: usize,
    /// Distance between achieved and desired goal after the last step: meters in the Fetch tasks.
    pub final_distance: f64,
    /// Whether the last step was a success: the benchmark's success rate counts these.
    pub success: bool,
    /// Whether any step was a success.
    pub success_any: bool,
    /// The goals, and what the policy did as a controller; `None` in the episodes of a
    /// [`Collector`](crate::Collector), which does not measure them.
    #[serde(default)]
    pub controls: Option<Controls>,
}

/// The goals of an episode, and what the policy did as a controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Controls {
    /// The achieved goal after the reset.
    pub start_goal: Vec<f64>,
    /// The desired goal after the reset.
    pub desired_goal: Vec<f64>,
    /// Number of steps up to the first success; `None` without a success.
    pub steps_to_success: Option<usize>,
    /// Mean squared change from an action to the next, summed over its elements; 0 for one step.
    pub action_change: f64,
    /// Largest absolute element of the actions, before the environment clips them.
    pub largest_action: f64,
    /// Length of the path of [what the actions move](GoalObservation::position), as observed:
    /// meters in the Fetch tasks, where it is the gripper. `None` if observations do not show it.
    pub path: Option<f64>,
    /// Sum of the squared elements of all actions.
    pub energy: f64,
}

impl Episode {
    /// Starts an episode without steps.
    pub(crate) const fn new(seed: Option<u64>) -> Self {
        Self {
            seed,
            episode_return: 0.0,
            episode_length: 0,
            final_distance: f64::NAN,
            success: false,
            success_any: false,
            controls: None,
        }
    }

    /// Adds a step.
    pub(crate) fn add(&mut self, reward: f64, info: &Info) {
        self.episode_return += reward;
        self.episode_length += 1;
        self.final_distance = info.distance;
        self.success = info.is_success;
        self.success_any |= info.is_success;
    }
}

/// An unfinished episode with observations of the type `O`, and its controls.
pub(super) struct Measured<O> {
    episode: Episode,
    controls: Controls,
    /// The sum of the squared changes of the actions.
    changes: f64,
    /// The last action; empty before the first.
    action: Vec<f64>,
    position: Option<[f64; 3]>,
    observation: PhantomData<O>,
}

impl<O: GoalObservation> Measured<O> {
    /// Starts an episode with the parts of its first observation.
    pub(super) fn start(
        seed: Option<u64>,
        achieved_goal: &[f64],
        desired_goal: &[f64],
        observation: &[O::Element],
    ) -> Self {
        let position = O::position(observation);
        let controls = Controls {
            start_goal: achieved_goal.to_vec(),
            desired_goal: desired_goal.to_vec(),
            steps_to_success: None,
            action_change: 0.0,
            largest_action: 0.0,
            path: position.map(|_| 0.0),
            energy: 0.0,
        };
        let (changes, action, observation) = (0.0, Vec::new(), PhantomData);
        Self { episode: Episode::new(seed), controls, changes, action, position, observation }
    }

    /// Returns the number of steps.
    pub(super) const fn len(&self) -> usize {
        self.episode.episode_length
    }

    /// Adds a step: its action, and what it led to.
    pub(super) fn add<A: ArrayElement>(
        &mut self,
        action: &[A],
        observation: &[O::Element],
        reward: f64,
        info: &Info,
    ) {
        let Self { episode, controls, .. } = self;
        episode.add(reward, info);
        if info.is_success {
            controls.steps_to_success.get_or_insert(episode.episode_length);
        }
        for (last, now) in self.action.iter().zip(action) {
            self.changes += (now.to_f64() - last).powi(2);
        }
        self.action.clear();
        self.action.extend(action.iter().map(|element| element.to_f64()));
        for element in &self.action {
            controls.energy += element * element;
            controls.largest_action = controls.largest_action.max(element.abs());
        }
        let position = O::position(observation);
        controls.path = controls.path.zip(self.position).zip(position).map(|((path, from), to)| {
            let square: f64 = from.iter().zip(to).map(|(from, to)| (to - from).powi(2)).sum();
            path + square.sqrt()
        });
        self.position = position;
    }

    pub(super) fn finish(mut self) -> Episode {
        let changes = self.len().saturating_sub(1).max(1);
        self.controls.action_change = self.changes / changes as f64;
        Episode { controls: Some(self.controls), ..self.episode }
    }
}
