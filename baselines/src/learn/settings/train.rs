//! The settings of a training run.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::algorithm::{AlgorithmSettings, DdpgSettings};
use super::range::ranged_settings;
use crate::learn::error::TrainError;

/// The settings of a training run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainSettings {
    /// The algorithm and its settings.
    pub algorithm: AlgorithmSettings,
    /// What is stored, and how it is drawn.
    pub replay: ReplaySettings,
    /// What the networks see.
    pub inputs: InputSettings,
    /// How actions are chosen while collecting.
    pub exploration: ExplorationSettings,
    /// How often to collect, update and evaluate.
    pub schedule: ScheduleSettings,
}

/// Settings that assume nothing about the task, to start from with your own environment: no
/// distances, no episodes or transitions left out, and evaluations in proportion to the steps of a
/// run. Goals need no meaningful difference, which angles lack.
impl Default for TrainSettings {
    fn default() -> Self {
        Self {
            algorithm: AlgorithmSettings::Ddpg(DdpgSettings::default()),
            replay: ReplaySettings {
                capacity: 1_000_000,
                batch_size: 256,
                future_k: 4.0,
                past_desired: 0.0,
                already_achieved: 1.0,
                still_distance: 0.0,
                still_kept: 1.0,
                mirrored: 0.0,
                goal_noise: 0.0,
                goal_noise_share: 0.0,
                strictness: 1.0,
                n_step: 1,
                n_step_updates: None,
            },
            inputs: InputSettings {
                relative_goal: false,
                min_std: 0.0001,
                clip: 5.0,
                left_out: Vec::new(),
            },
            exploration: ExplorationSettings {
                random_episodes: 20,
                random_episode_share: 0.1,
                random_action: 0.3,
                held_actions: 1,
                random_beginning: 0,
                far_starts: 0.0,
                quiet_episodes: 0.0,
            },
            schedule: ScheduleSettings {
                num_envs: 8,
                steps_per_cycle: 50,
                updates_per_cycle: 160,
                evaluation_interval: None,
                evaluation_episodes: 100,
                per_rank: false,
            },
        }
    }
}

impl TrainSettings {
    /// Returns the settings of one of `size` processes.
    pub(crate) fn of_one(&self, size: usize) -> Result<Self, TrainError> {
        let mut own = self.clone();
        if self.schedule.per_rank {
            return Ok(own);
        }
        let divide = |name, total: usize| {
            let expected = "choose a multiple of the number of processes";
            let uneven = TrainError::Setting { name, value: total.to_string(), expected };
            if total.is_multiple_of(size) { Ok(total / size) } else { Err(uneven) }
        };
        own.schedule.num_envs = divide("num_envs", self.schedule.num_envs)?;
        own.replay.batch_size = divide("batch_size", self.replay.batch_size)?;
        own.replay.capacity = self.replay.capacity / size;
        own.exploration.random_episodes = self.exploration.random_episodes.div_ceil(size as u64);
        Ok(own)
    }

    /// Returns the number of random episodes of `size` processes, before the first update.
    pub(crate) const fn random_episodes_of_all(&self, size: usize) -> u64 {
        let factor = if self.schedule.per_rank { size as u64 } else { 1 };
        self.exploration.random_episodes.saturating_mul(factor)
    }

    /// Returns the settings as JSON, by way of text, in which an `f32` has its own digits and not
    /// those of an `f64`.
    pub(crate) fn to_json(&self) -> Value {
        serde_json::to_string(self).and_then(|text| serde_json::from_str(&text)).unwrap_or_default()
    }

    /// Returns the name and the value of each setting.
    pub(crate) fn each(&self) -> Vec<(String, String)> {
        fn add(name: &str, value: &Value, all: &mut Vec<(String, String)>) {
            match value {
                Value::Object(entries) => {
                    entries.iter().for_each(|(name, value)| add(name, value, all));
                }
                value => all.push((name.to_owned(), value.to_string())),
            }
        }
        let mut all = Vec::new();
        add("settings", &self.to_json(), &mut all);
        all
    }

    /// Checks that each setting is in the range that its documentation says.
    ///
    /// # Errors
    /// [`TrainError::Setting`] with the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        let Self { algorithm, replay, inputs, exploration, schedule } = self;
        match algorithm {
            AlgorithmSettings::Ddpg(settings) => settings.check(),
            AlgorithmSettings::Sac(settings) => settings.check(),
            AlgorithmSettings::Other(settings) if is_deeper(settings, MOST_NESTED) => {
                Err(TrainError::Setting {
                    name: "algorithm",
                    value: format!("nested more than {MOST_NESTED} deep"),
                    expected: "put its settings into fewer lists and objects",
                })
            }
            AlgorithmSettings::Other(_) => Ok(()),
        }?;
        replay.check()?;
        inputs.check()?;
        exploration.check()?;
        schedule.check()
    }
}

/// How deep the settings of your own algorithm may be nested: files that are nested more than 128
/// deep are not read.
const MOST_NESTED: usize = 100;

/// Whether lists and objects are nested more than `most` deep.
fn is_deeper(value: &Value, most: usize) -> bool {
    match value {
        Value::Array(values) => most == 0 || values.iter().any(|value| is_deeper(value, most - 1)),
        Value::Object(entries) => {
            most == 0 || entries.values().any(|value| is_deeper(value, most - 1))
        }
        _ => false,
    }
}

ranged_settings! {
    /// What is stored, and how it is drawn.
    pub struct ReplaySettings {
        /// The number of transitions that the buffer holds: 1,000,000, the authors'.
        pub capacity: usize => 1..=100_000_000,
        /// The number of transitions of a batch: 128, measured, because an update of 128 teaches as
        /// much as one of 256; 256 for Reach, as the authors, and for Slide.
        pub batch_size: usize => 1..=8_192,
        /// How many transitions get a goal achieved later in their episode, for each that keeps its
        /// own: 4, the authors'.
        pub future_k: f64 => 0.0..=1_000.0,
        /// The weight, relative to future goals, of goals that other episodes pursued: 0, and 1 for
        /// Push and Slide, as in MRL.
        pub past_desired: f64 => 0.0..=1_000.0,
        /// The probability of keeping a transition whose goal was already achieved before the step:
        /// 0.2, measured, because they teach nothing. The authors: 1.
        pub already_achieved: f64 => 0.0..=1.0,
        /// The farthest that an achieved goal moves in an episode that counts as still, in the unit
        /// of the goals: 0.01 m.
        pub still_distance: f64 => 0.0..=1_000.0,
        /// The probability of keeping a still episode: 0.1, measured. The authors: 1.
        pub still_kept: f64 => 0.0..=1.0,
        /// The share of the drawn transitions that are mirrored, in an environment with
        /// [symmetries](fetch_env::GoalEnv::symmetries), of which each batch uses one: 0, the
        /// authors'.
        ///
        /// 0.75 for Push and PickAndPlace, which have three, and 0.5 for Slide, which has one.
        /// Measured on Push, seeds 100 to 102, with the preset's other settings: the success rate
        /// reaches 0.9 after 72,000 steps with three symmetries, and after 80,000 to 96,000 with
        /// 0.5 of left and right alone.
        pub mirrored: f64 => 0.0..=1.0,
        /// The farthest that noise moves a relabeled goal, in the unit of the goals: 0, the
        /// authors', 0.04 m for Push and PickAndPlace, and 0.03 m for Slide.
        pub goal_noise: f64 => 0.0..=1_000.0,
        /// The share of the relabeled goals that are moved: 0, the authors', and 0.5 for tasks with
        /// an object.
        pub goal_noise_share: f64 => 0.0..=1.0,
        /// The factor by which training overstates the distance to the goal: 1, the authors', and
        /// 1.43 for Slide, which is then rewarded within 3.5 cm in training, and succeeds within
        /// 5 cm in evaluations.
        pub strictness: f64 => 1.0..=1_000.0,
        /// The most steps of a window: the target of a value is the discounted sum of the rewards
        /// of these steps and the value of the state after them. 1, the authors', and 2 for Push.
        ///
        /// Rewards spread through long windows in fewer updates. But their actions are those that
        /// were taken, exploring ones included, and not the actor's. Measured on Push, seeds 100 to
        /// 107: the success rate reaches 0.9 after 64,000 steps in the median with windows of two
        /// steps, and after 72,000 with windows of one. PickAndPlace learns much later with them
        /// (seed 100), and Slide ends no better (five seeds).
        pub n_step: usize => 1..=50,
        /// The number of updates with such windows, after which all windows have one step: `None`
        /// for all updates, and 16,000 for Push.
        pub n_step_updates: Option<u64> => 0..=1_000_000_000,
    }
}

ranged_settings! {
    /// What the networks see.
    pub struct InputSettings {
        /// Whether the networks see the difference from the achieved to the desired goal instead of
        /// the desired goal: true, measured. The authors: false, with `relative_goals` as a
        /// setting.
        pub relative_goal: bool,
        /// The smallest standard deviation by which inputs are divided: 0.01, the authors'.
        pub min_std: f64 => 1e-6..=1_000.0,
        /// The bound to which normalized inputs are clipped: 5, the authors'.
        pub clip: f64 => 0.01..=1_000.0,
        /// The elements of an observation that the networks do not see, counted from 0: none, the
        /// authors', the positions of gripper and object for Push and PickAndPlace, and the
        /// object's angles for Slide. [`Trainer::new`](crate::learn::Trainer::new) refuses one that the
        /// observation does not have, or that is named twice.
        pub left_out: Vec<usize>,
    }
}

ranged_settings! {
    /// How actions are chosen while collecting.
    pub struct ExplorationSettings {
        /// The number of wholly random episodes before the first update: 300, measured, and 4 for
        /// Reach. The authors: 0.
        pub random_episodes: u64 => 0..=1_000_000,
        /// The share of later episodes that are wholly random: 0.05, measured, and 0.25 for Reach.
        /// The authors: 0.
        pub random_episode_share: f64 => 0.0..=1.0,
        /// The probability of a random action in an episode with noise: 0.3, the authors', and 0
        /// for Slide, where one can ruin a strike.
        pub random_action: f64 => 0.0..=1.0,
        /// The most steps for which an action is held in wholly random episodes and in random
        /// beginnings: 1, the authors', and 9 for tasks with an object. The number is drawn anew
        /// for each action.
        pub held_actions: u64 => 1..=1_000,
        /// The most random steps with which an episode with noise begins: 0, the authors', and 15
        /// for Slide, so that the actor also strikes from where they have taken the gripper. The
        /// number is drawn anew for each episode.
        pub random_beginning: u64 => 0..=1_000,
        /// The share of the episodes that begin far from their goal, at the farthest of four drawn
        /// starts: 0, the authors', and 0.5 for Slide.
        pub far_starts: f64 => 0.0..=1.0,
        /// The share of the episodes after `random_episodes` in which all actions are the actor's,
        /// without noise: 0, the authors', and 0.5 for Push and Slide, where they show the learner
        /// how the actor's own pushes and strikes end. `random_episode_share` comes first: with 0.6
        /// of both, 0.4 of the episodes are quiet.
        pub quiet_episodes: f64 => 0.0..=1.0,
    }
}

ranged_settings! {
    /// How often to collect, update and evaluate.
    pub struct ScheduleSettings {
        /// The number of environments that are stepped together.
        pub num_envs: usize => 1..=1_024,
        /// The number of steps of each environment between updates: 50, an episode.
        pub steps_per_cycle: usize => 1..=1_000,
        /// The number of updates that follow.
        pub updates_per_cycle: usize => 1..=10_000,
        /// The number of steps of all environments between two evaluations; `None`: a twentieth of
        /// the steps passed to [`run`](crate::learn::Trainer::run), with an evaluation at their end.
        pub evaluation_interval: Option<u64> => 1..=1_000_000_000,
        /// The number of greedy episodes of an evaluation: 100, and 20 for Reach.
        pub evaluation_episodes: usize => 1..=10_000,
        /// Whether `num_envs`, `batch_size`, `capacity` and `random_episodes` are those of each
        /// process, and not totals that the processes share: false, so that a run learns the same
        /// from the same number of steps on any number of processes. The authors: true.
        pub per_rank: bool,
    }
}
