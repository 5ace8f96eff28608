//! The figures of an evaluation.

use std::collections::BTreeMap;

use fetch_env::{EnvError, vec_env::VecEnvError};
use serde::{Deserialize, Serialize};

use super::episode::{Controls, Episode};
use crate::policy::PolicyError;
use crate::statistics::{Estimate, StatisticsError};
use crate::workers::UnreadableMessage;

/// The episodes of an evaluation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// One entry for each episode, in the order of their seeds.
    pub episodes: Vec<Episode>,
}

/// The figures of an evaluation, each with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Share of episodes whose last step was a success.
    pub success_rate: Estimate,
    /// Share of episodes with a success at any step.
    pub success_any_rate: Estimate,
    /// Mean sum of rewards.
    pub episode_return_mean: Estimate,
    /// Mean number of steps.
    pub episode_length_mean: Estimate,
    /// Mean distance at the end: meters in the Fetch tasks.
    pub final_distance_mean: Estimate,
    /// What the policy did as a controller, among the other figures when serialized; `None` if an
    /// episode has no [`controls`](Episode::controls), or if one of their numbers is not finite.
    #[serde(flatten)]
    pub controls: Option<ControlSummary>,
}

/// What a policy did as a controller: means over the episodes of their [`Controls`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControlSummary {
    /// Mean number of steps up to the first success, over the episodes with one; `None` if there
    /// are none.
    pub steps_to_success_mean: Option<Estimate>,
    /// Mean of the mean squared changes of the action.
    pub action_change_mean: Estimate,
    /// Mean of the largest absolute elements of the actions.
    pub largest_action_mean: Estimate,
    /// Mean length of the path, in meters in the Fetch tasks; `None` if it is not observed.
    pub path_mean: Option<Estimate>,
    /// Mean sum of the squared actions.
    pub energy_mean: Estimate,
}

/// Error returned when a policy is evaluated or its episodes are summarized.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum EvaluationError {
    /// There are no episodes to take a mean of.
    #[error("there is no episode to evaluate: run at least one")]
    NoEpisodes,
    /// The policy does not fit this environment.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// The environment failed.
    #[error("episode {episode} (seed {seed}) failed")]
    Environment {
        /// The episode, counted from 0.
        episode: usize,
        /// The seed of its reset.
        seed: u64,
        /// The environment's error.
        source: EnvError,
    },
    /// The environments could not be stepped together.
    #[error(transparent)]
    Vec(#[from] VecEnvError),
    /// A return or a distance is not a finite number.
    #[error("no mean can be taken over the episodes")]
    Statistics(#[from] StatisticsError),
    /// The caller stopped it.
    #[error("the evaluation was stopped before its end")]
    Stopped,
    /// Another process sent episodes that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] UnreadableMessage),
}

debug_as_display!(EvaluationError);

impl Evaluation {
    /// Returns the figures over all episodes.
    ///
    /// # Errors
    /// [`EvaluationError::NoEpisodes`] if there are none, and [`EvaluationError::Statistics`] if a
    /// return or a distance is not finite.
    pub fn summary(&self) -> Result<Summary, EvaluationError> {
        if self.episodes.is_empty() {
            return Err(EvaluationError::NoEpisodes);
        }
        let count = |test: fn(&Episode) -> bool| self.episodes.iter().filter(|e| test(e)).count();
        let mean = |value: fn(&Episode) -> f64| {
            Estimate::mean(&self.episodes.iter().map(value).collect::<Vec<_>>())
        };
        let total = self.episodes.len();
        let controls = self.episodes.iter().map(|e| e.controls.as_ref());
        Ok(Summary {
            success_rate: Estimate::share(count(|e| e.success), total)?,
            success_any_rate: Estimate::share(count(|e| e.success_any), total)?,
            episode_return_mean: mean(|e| e.episode_return)?,
            episode_length_mean: mean(|e| e.episode_length as f64)?,
            final_distance_mean: mean(|e| e.final_distance)?,
            controls: controls
                .collect::<Option<Vec<_>>>()
                .and_then(|controls| ControlSummary::of(&controls).ok()),
        })
    }

    /// Returns the episodes by a name for each, such as its [`stratum`](crate::stratum).
    ///
    /// ```
    /// use baselines::{ScriptedPolicy, evaluate, stratum};
    /// use fetch_env::{Task, make_kinematic};
    ///
    /// let mut env = make_kinematic("FetchPickAndPlace-v4")?;
    /// let task = Task::PickAndPlace;
    /// let evaluation = evaluate(&mut env, &mut ScriptedPolicy::new(task), 20, 0, |_| ())?;
    /// let strata = evaluation.strata(|episode| stratum(task, episode));
    /// assert!(strata[&Some("air")].summary()?.success_rate.value > 0.9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn strata<N: Ord>(&self, name: impl Fn(&Episode) -> N) -> BTreeMap<N, Self> {
        let mut strata = BTreeMap::<N, Self>::new();
        for episode in &self.episodes {
            let stratum = strata.entry(name(episode)).or_insert(Self { episodes: Vec::new() });
            stratum.episodes.push(episode.clone());
        }
        strata
    }

    /// Returns the success rate at each of these distance thresholds: as in the environment, an
    /// episode succeeds if the distance after its last step is strictly below the threshold.
    ///
    /// # Errors
    /// [`EvaluationError::NoEpisodes`] if there are no episodes.
    pub fn success_at(&self, thresholds: &[f64]) -> Result<Vec<Estimate>, EvaluationError> {
        if self.episodes.is_empty() {
            return Err(EvaluationError::NoEpisodes);
        }
        thresholds
            .iter()
            .map(|&threshold| {
                let below = self.episodes.iter().filter(|e| e.final_distance < threshold).count();
                Ok(Estimate::share(below, self.episodes.len())?)
            })
            .collect()
    }
}

impl ControlSummary {
    fn of(controls: &[&Controls]) -> Result<Self, StatisticsError> {
        let mean = |value: fn(&Controls) -> f64| {
            Estimate::mean(&controls.iter().map(|controls| value(controls)).collect::<Vec<_>>())
        };
        let known = |numbers: Vec<f64>| match numbers.is_empty() {
            true => Ok(None),
            false => Estimate::mean(&numbers).map(Some),
        };
        let steps = controls.iter().filter_map(|controls| controls.steps_to_success);
        Ok(Self {
            steps_to_success_mean: known(steps.map(|steps| steps as f64).collect())?,
            action_change_mean: mean(|controls| controls.action_change)?,
            largest_action_mean: mean(|controls| controls.largest_action)?,
            path_mean: known(controls.iter().filter_map(|controls| controls.path).collect())?,
            energy_mean: mean(|controls| controls.energy)?,
        })
    }
}
