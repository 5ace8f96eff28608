//! The settings of a training run.

use fetch_env::Task;
use her_relabel::GoalStrategy;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::algorithm::{AlgorithmSettings, DdpgSettings};
use super::pixels::PixelActorSettings;
use super::range::ranged_settings;
use crate::learn::error::TrainError;

/// The settings of a training run.
///
/// # What the presets choose
/// The columns of the tasks are those of `fast`, and `book` is for a task, too. An empty cell has the
/// default; `-` is a setting of another algorithm. Settings that have their default in every preset
/// are left out.
///
#[doc = include_str!("presets.md")]
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
    /// The actor that sees pictures, of a run [with pixels](crate::learn::Trainer::with_pixels).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixels: Option<PixelActorSettings>,
}

/// Settings that assume nothing about the task, to start from with your own environment: no
/// distances, no episodes or transitions left out, and evaluations in proportion to the steps of a
/// run. Goals need no meaningful difference, which angles lack.
impl Default for TrainSettings {
    fn default() -> Self {
        Self {
            algorithm: AlgorithmSettings::Ddpg(DdpgSettings::default()),
            replay: ReplaySettings::default(),
            inputs: InputSettings::default(),
            exploration: ExplorationSettings::default(),
            schedule: ScheduleSettings::default(),
            pixels: None,
        }
    }
}

impl TrainSettings {
    /// Returns settings for an [on-policy](crate::learn::Algorithm::is_on_policy) algorithm, such as
    /// [`Ppo`](crate::learn::Ppo): one update in each cycle, from steps of the actor alone. Like the
    /// [default](Self::default), they assume nothing about the task.
    ///
    /// A run draws nothing from its buffer but the statistics that normalize inputs, so it refuses
    /// other values of settings that would have no effect.
    #[must_use]
    pub fn on_policy(algorithm: AlgorithmSettings) -> Self {
        let Self { replay, inputs, exploration, schedule, .. } = Self::default();
        Self {
            algorithm,
            replay: ReplaySettings { capacity: 10_000, future_k: 0.0, ..replay },
            inputs,
            exploration: ExplorationSettings {
                random_episodes: 0,
                random_episode_share: 0.0,
                random_action: 0.0,
                ..exploration
            },
            schedule: ScheduleSettings { updates_per_cycle: 1, ..schedule },
            pixels: None,
        }
    }

    /// Checks that the settings which have no effect on an on-policy algorithm are as in
    /// [`on_policy`](Self::on_policy).
    pub(crate) fn check_on_policy(&self, algorithm: &str) -> Result<(), TrainError> {
        let Self { replay, inputs, exploration, schedule, pixels, .. } = self.clone();
        let mut expected = Self::on_policy(self.algorithm.clone());
        expected.replay.capacity = replay.capacity;
        expected.inputs = InputSettings { actor_observation_noise: 0.0, ..inputs };
        expected.exploration.far_start_share = exploration.far_start_share;
        expected.schedule = ScheduleSettings { updates_per_cycle: 1, ..schedule };
        expected.pixels = pixels;
        let pairs = each_setting(self).into_iter().zip(each_setting(&expected));
        match pairs.into_iter().find(|(own, expected)| own != expected) {
            None => Ok(()),
            Some(((name, value), (_, expected))) => {
                let algorithm = algorithm.to_owned();
                Err(TrainError::Unused { name, value, expected, algorithm })
            }
        }
    }

    /// Adds the settings of an actor that sees pictures, for a Fetch task.
    #[must_use]
    pub fn with_pixels(self, task: Task) -> Self {
        Self { pixels: Some(PixelActorSettings::of_task(task)), ..self }
    }

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
        if !matches!(self.algorithm, AlgorithmSettings::Ppo(_)) {
            own.replay.batch_size = divide("batch_size", self.replay.batch_size)?;
        }
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
        json_of(self)
    }

    /// Checks that each setting is in the range that its documentation says, and has an effect.
    ///
    /// # Errors
    /// [`TrainError::Setting`] with the first that is not, and [`TrainError::Unused`] with one of
    /// the settings that [`on_policy`](Self::on_policy) fixes for PPO.
    pub fn check(&self) -> Result<(), TrainError> {
        let Self { algorithm, replay, inputs, exploration, schedule, pixels } = self;
        match algorithm {
            AlgorithmSettings::Ddpg(settings) => settings.check(),
            AlgorithmSettings::Sac(settings) => settings.check(),
            AlgorithmSettings::Ppo(settings) => settings.check(),
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
        schedule.check()?;
        pixels.iter().try_for_each(PixelActorSettings::check)?;
        match algorithm {
            AlgorithmSettings::Ppo(_) => self.check_on_policy(algorithm.name()),
            _ => Ok(()),
        }
    }
}

pub(crate) fn json_of(settings: &impl Serialize) -> Value {
    serde_json::to_string(settings).and_then(|text| serde_json::from_str(&text)).unwrap_or_default()
}

/// Returns settings as lines of JSON, in their own order.
pub(crate) fn json_text(settings: &impl Serialize) -> String {
    serde_json::to_string_pretty(settings).unwrap_or_default()
}

/// Returns the name and the value of each setting of a learner or an environment.
pub(crate) fn each_setting(settings: &impl Serialize) -> Vec<(String, String)> {
    fn add(name: &str, value: &Value, all: &mut Vec<(String, String)>) {
        match value {
            Value::Object(entries) => {
                entries.iter().for_each(|(name, value)| add(name, value, all));
            }
            value => all.push((name.to_owned(), value.to_string())),
        }
    }
    let mut all = Vec::new();
    add("settings", &json_of(settings), &mut all);
    all
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
        /// The number of transitions that the buffer holds.
        pub capacity: usize = 1_000_000 => 1..=100_000_000,
        /// The number of transitions of a batch.
        pub batch_size: usize = 256 => 1..=8_192,
        /// How many transitions get another goal in hindsight, for each that keeps its own: 0 for
        /// training without hindsight.
        pub future_k: f64 = 4.0 => 0.0..=1_000.0,
        /// Which achieved goals they get: the future ones of their episode, unless you choose
        /// others.
        pub goal_strategy: HindsightGoals = HindsightGoals::Future,
        /// The weight, relative to achieved goals, of goals that other episodes pursued, as in MRL.
        /// [`Trainer::new`](crate::learn::Trainer::new) refuses it with a `future_k` of 0.
        pub past_goal_weight: f64 = 0.0 => 0.0..=1_000.0,
        /// The probability of keeping a drawn transition whose goal was already achieved before the
        /// step. Such transitions teach little.
        pub keep_already_achieved: f64 = 1.0 => 0.0..=1.0,
        /// The farthest that an achieved goal moves in an episode that counts as motionless, in the
        /// unit of the goals.
        pub still_distance: f64 = 0.0 => 0.0..=1_000.0,
        /// The probability of storing a motionless episode.
        pub keep_motionless: f64 = 1.0 => 0.0..=1.0,
        /// The share of the drawn transitions that are mirrored, in an environment with
        /// [symmetries](fetch_env::GoalEnv::symmetries), of which each batch uses one.
        ///
        /// With 0.75 for three symmetries and 0.5 for one, each occurs as often as the transition
        /// itself. Push learns sooner with all three than with left and right alone.
        pub mirrored: f64 = 0.0 => 0.0..=1.0,
        /// The farthest that noise moves a relabeled goal, in the unit of the goals.
        pub goal_noise: f64 = 0.0 => 0.0..=1_000.0,
        /// The share of the relabeled goals that are moved.
        pub goal_noise_share: f64 = 0.0 => 0.0..=1.0,
        /// The factor by which training overstates the distance to the goal. With 1.43, an episode
        /// that succeeds within 5 cm in an evaluation must come within 3.5 cm in training.
        pub distance_factor: f64 = 1.0 => 1.0..=1_000.0,
        /// The most steps of a window: the target of a value is the discounted sum of the rewards
        /// of these steps and the value of the state after them.
        ///
        /// Rewards spread through long windows in fewer updates. But their actions are those that
        /// were taken, exploring ones included, and not the actor's. Push learns sooner with windows
        /// of two steps, and PickAndPlace much later.
        pub n_step: usize = 1 => 1..=50,
        /// The number of updates with such windows, after which all windows have one step; `None`
        /// for all updates.
        pub n_step_updates: Option<u64> = None => 0..=1_000_000_000,
    }
}

/// The achieved goals that transitions get in hindsight; the [strategies](GoalStrategy) of the same
/// names of Andrychowicz et al., *Hindsight experience replay*, 2017.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum HindsightGoals {
    /// Those achieved after the transition, until its episode ends.
    Future,
    /// The one at the end of its episode.
    Final,
    /// Those of its episode.
    Episode,
    /// Those of the whole buffer.
    Random,
}

impl From<HindsightGoals> for GoalStrategy {
    fn from(goals: HindsightGoals) -> Self {
        match goals {
            HindsightGoals::Future => Self::Future,
            HindsightGoals::Final => Self::Final,
            HindsightGoals::Episode => Self::Episode,
            HindsightGoals::Random => Self::Random,
        }
    }
}

ranged_settings! {
    /// What the networks see.
    pub struct InputSettings {
        /// Whether the networks see the difference from the achieved to the desired goal instead of
        /// the desired goal. Goals whose difference means nothing, such as angles, need false.
        pub relative_goal: bool = false,
        /// The smallest standard deviation by which inputs are divided.
        pub min_std: f64 = 0.0001 => 1e-6..=1_000.0,
        /// The bound to which normalized inputs are clipped.
        pub clip: f64 = 5.0 => 0.01..=1_000.0,
        /// The standard deviation of the noise on each element of the observations that the actor
        /// sees, in the unit of the element, while collecting and in updates. What is stored is
        /// exact, and so is what the critic sees: the actor learns the actions that are best
        /// whatever the noise hides. Evaluations have the noise of their environment.
        pub actor_observation_noise: f64 = 0.0 => 0.0..=1_000.0,
        /// The elements of an observation that the networks do not see, counted from 0.
        /// [`Trainer::new`](crate::learn::Trainer::new) refuses one that the observation does not
        /// have, or that is named twice.
        pub left_out: Vec<usize> = vec![],
    }
}

ranged_settings! {
    /// How actions are chosen while collecting.
    pub struct ExplorationSettings {
        /// The number of wholly random episodes before the first update.
        pub random_episodes: u64 = 20 => 0..=1_000_000,
        /// The share of later episodes that are wholly random.
        pub random_episode_share: f64 = 0.1 => 0.0..=1.0,
        /// The probability of a random action in an episode with noise. Where one action can ruin
        /// an episode, as a strike in Slide, choose 0.
        pub random_action: f64 = 0.3 => 0.0..=1.0,
        /// The most steps for which an action is held in wholly random episodes and in random
        /// starts. The number is drawn anew for each action.
        pub max_action_hold: u64 = 1 => 1..=1_000,
        /// The most random steps with which an episode with noise begins, so that the actor also
        /// acts from where they have taken the robot. The number is drawn anew for each episode.
        pub max_random_start_steps: u64 = 0 => 0..=1_000,
        /// The share of the episodes that begin far from their goal, at the farthest of four drawn
        /// starts.
        pub far_start_share: f64 = 0.0 => 0.0..=1.0,
        /// The share of the episodes after `random_episodes` in which all actions are the actor's,
        /// without noise, which shows the learner how the actor's own attempts end.
        /// `random_episode_share` comes first: with 0.6 of both, 0.4 of the episodes have no noise.
        pub noise_free_share: f64 = 0.0 => 0.0..=1.0,
    }
}

ranged_settings! {
    /// How often to collect, update and evaluate.
    pub struct ScheduleSettings {
        /// The number of environments that are stepped together.
        pub num_envs: usize = 8 => 1..=1_024,
        /// The number of steps of each environment between updates. A Fetch episode has 50.
        pub steps_per_cycle: usize = 50 => 1..=10_000,
        /// The number of updates that follow.
        pub updates_per_cycle: usize = 160 => 1..=10_000,
        /// The number of steps of all environments between two evaluations; `None`: a twentieth of
        /// the steps passed to [`run`](crate::learn::Trainer::run), with an evaluation at their end.
        pub evaluation_interval: Option<u64> = None => 1..=1_000_000_000,
        /// The number of greedy episodes of an evaluation.
        pub evaluation_episodes: usize = 100 => 1..=10_000,
        /// Whether `num_envs`, `batch_size`, `capacity` and `random_episodes` are those of each
        /// process, and not totals that the processes share. With totals, a run learns the same from
        /// the same number of steps on any number of processes.
        pub per_rank: bool = false,
    }
}
