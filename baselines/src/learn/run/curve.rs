//! The learning curve of a run.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::learn::algorithm::interface::Losses;
use crate::statistics::Estimate;

/// The counts of a run so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Counters {
    /// The number of steps of all environments.
    pub steps: u64,
    /// The number of finished episodes.
    pub episodes: u64,
    /// The number of demonstrated episodes that the run began with.
    pub demonstrations: u64,
    /// The number of episodes discarded because their environment failed.
    pub discarded_episodes: u64,
    /// The number of updates.
    pub updates: u64,
    /// The number of evaluations.
    pub evaluations: u64,
    /// The time spent collecting and updating, in seconds.
    pub seconds: f64,
}

impl Counters {
    /// Returns the counts, each with its name.
    pub(crate) const fn counts(&self) -> [(&'static str, u64); 6] {
        let Self {
            steps, episodes, demonstrations, discarded_episodes, updates, evaluations, ..
        } = *self;
        [
            ("steps", steps),
            ("episodes", episodes),
            ("demonstrations", demonstrations),
            ("discarded episodes", discarded_episodes),
            ("updates", updates),
            ("evaluations", evaluations),
        ]
    }
}

/// A row of the learning curve: the state of the run at an evaluation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CurveRow {
    /// The counters at the evaluation.
    pub counters: Counters,
    /// The share of the greedy policy's episodes whose last step was a success.
    pub success_rate: Estimate,
    /// The mean sum of rewards of these episodes.
    pub episode_return_mean: f64,
    /// Their mean distance from the goal after the last step: meters in the Fetch tasks.
    pub final_distance_mean: f64,
    /// The success rate of the episodes collected since the last evaluation.
    pub collected_success: Option<f64>,
    /// The mean losses of the updates since the last evaluation.
    pub losses: Option<Losses>,
    /// Numbers that show how a run goes, by their names; a number that is not finite is left out.
    ///
    /// - `update/NAME`: what the algorithm [reports](crate::learn::Algorithm::diagnostics) of the last
    ///   update, such as the norms of gradients. [`Ddpg`](crate::learn::Ddpg) and
    ///   [`Sac`](crate::learn::Sac) report the mean target, and SAC its temperature, the entropy of
    ///   the actor and the mean value of each critic. [`Ppo`](crate::learn::Ppo) reports the `kl`
    ///   divergence from the actor before, the `clip_fraction`, and the `entropy`.
    /// - `buffer/distance` and `buffer/success`: the mean distance from the goal after a step of the
    ///   buffer, and the share of the steps that reach it.
    /// - `buffer/relabeled_success`: the share of the relabeled rows that reach their goal, as training
    ///   rewards it: the rows with a sparse reward of 0.
    ///
    /// The numbers of the buffer are means over about 1,000 drawn transitions.
    #[serde(default)]
    pub diagnostics: Diagnostics,
}

/// Numbers by their names.
pub(crate) type Diagnostics = BTreeMap<String, f32>;

/// The success rate at which a run may stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// The success rate to reach.
    pub success_rate: f64,
    /// The number of evaluations in a row that must reach it.
    pub evaluations: usize,
}

/// What has a success rate, and can reach a [`Target`].
pub trait Evaluated {
    /// Returns the success rate of the greedy policy.
    fn success_rate(&self) -> f64;
}

impl Evaluated for CurveRow {
    fn success_rate(&self) -> f64 {
        self.success_rate.value
    }
}

impl Target {
    /// Whether the last rows of a curve reach the target.
    #[must_use]
    pub fn is_reached(&self, rows: &[impl Evaluated]) -> bool {
        let reaches = |row: &_| Evaluated::success_rate(row) >= self.success_rate;
        rows.len() >= self.evaluations && rows.iter().rev().take(self.evaluations).all(reaches)
    }

    /// Returns the row of a curve with which the target was reached first.
    #[must_use]
    pub fn first_reached<'a, R: Evaluated>(&self, rows: &'a [R]) -> Option<&'a R> {
        let mut reached = (0..rows.len()).filter(|&last| self.is_reached(&rows[..=last]));
        reached.next().map(|last| &rows[last])
    }
}

/// The time that the updates of a [`Trainer`](crate::learn::Trainer) have taken since it was made or
/// resumed, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct UpdateSeconds {
    /// The time in all.
    pub total: f64,
    /// The part of it spent averaging over processes, waiting included.
    pub exchanging: f64,
}

/// Sums since the last evaluation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Recent {
    episodes: u64,
    successes: u64,
    updates: u64,
    critic: f64,
    actor: f64,
    value: f64,
    /// What the algorithm reported of the last update.
    #[serde(default)]
    pub(super) diagnostics: Diagnostics,
}

impl Recent {
    pub(super) const fn add_episodes(&mut self, episodes: u64, successes: u64) {
        self.episodes += episodes;
        self.successes += successes;
    }

    /// Returns the counts, each with its name.
    pub(crate) const fn counts(&self) -> [(&'static str, u64); 3] {
        let Self { episodes, successes, updates, .. } = self;
        [("episodes", *episodes), ("successes", *successes), ("updates", *updates)]
    }

    /// Returns the success rate of the episodes.
    pub(super) fn success_rate(&self) -> Option<f64> {
        (self.episodes > 0).then(|| self.successes as f64 / self.episodes as f64)
    }

    pub(super) fn add(&mut self, losses: Losses) {
        self.updates += 1;
        self.critic += f64::from(losses.critic);
        self.actor += f64::from(losses.actor);
        self.value += f64::from(losses.value);
    }

    /// Returns the mean of the losses.
    pub(super) fn losses(&self) -> Option<Losses> {
        let mean = |sum: f64| (sum / self.updates as f64) as f32;
        let losses =
            Losses { critic: mean(self.critic), actor: mean(self.actor), value: mean(self.value) };
        (self.updates > 0).then_some(losses)
    }
}
