//! The settings of a distiller.

use fetch_env::Task;
use serde_json::Value;

use crate::learn::error::TrainError;
use crate::learn::settings::by_name::{SettingError, assigned, changed};
use crate::learn::settings::range::ranged_settings;
use crate::learn::settings::train::{InputSettings, json_of};

ranged_settings! {
    /// Settings of a [`Distiller`](crate::learn::Distiller). The defaults assume nothing about the
    /// task; [`of_task`](Self::of_task) has settings for the Fetch tasks.
    pub struct DistillSettings {
        /// The lengths of the student's hidden layers, which follow the convolutions of one that
        /// sees pictures.
        pub hidden: Vec<usize> = vec![256, 256] => 1..=1_024 in at most 4 layers,
        /// The learning rate. Pictures need more than states: 0.003 to 0.006.
        pub learning_rate: f32 = 0.001 => 1e-9..=1.0,
        /// The number of states of a batch.
        pub batch_size: usize = 128 => 1..=8_192,
        /// The number of updates for each step of all environments. A round's updates follow its
        /// steps.
        pub updates_per_step: usize = 2 => 1..=1_000,
        /// The fraction of the way that the student that is evaluated moves towards the learning one,
        /// which acts in rounds, after every update. It is larger in the first updates, so that the
        /// first weights are soon forgotten.
        pub average_fraction: f32 = 0.005 => 1e-6..=1.0,
        /// The number of environments stepped together.
        pub num_envs: usize = 16 => 1..=1_024,
        /// The number of steps that each environment takes in a round, which begins with new
        /// episodes. An episode that ends earlier is followed by another.
        pub steps_per_round: usize = 50 => 1..=100_000,
        /// The number of rounds in which the teacher acts, and its states set the scale of the
        /// inputs. In the later ones the student acts.
        pub teacher_rounds: u64 = 2 => 1..=1_000_000,
        /// The standard deviation of the noise on the teacher's actions when it acts.
        pub teacher_noise: f32 = 1.0 => 0.0..=10.0,
        /// The height below which an object has fallen: if the last element of an achieved goal is
        /// less, in meters, the next episode begins.
        pub fallen_below: Option<f64> = None => -1_000.0..=1_000.0,
        /// The number of states that are kept, the newest ones. A picture of 64 x 64 pixels takes
        /// 12 kB.
        pub capacity: usize = 50_000 => 1..=100_000_000,
        /// The elements of an observation that the student does not see, counted from 0. What a
        /// student sees beside pictures is its sight's.
        pub left_out: Vec<usize> = vec![],
        /// Whether the student sees the difference from the achieved to the desired goal instead of
        /// the desired goal. A student that sees pictures never does, because the achieved goal may
        /// be where the object is.
        pub relative_goal: bool = false,
        /// The smallest standard deviation by which inputs are divided.
        pub min_std: f64 = 0.01 => 1e-6..=1_000.0,
        /// The number of steps of all environments between two evaluations, rounded up to rounds.
        pub evaluation_interval: u64 = 1_600 => 1..=1_000_000_000,
        /// The number of episodes of an evaluation.
        pub evaluation_episodes: usize = 100 => 1..=100_000,
    }
}

impl DistillSettings {
    /// Returns the settings for a Fetch task, for a student that sees the state or pictures.
    ///
    /// Source: a prototype's, changed after runs of Push with the seeds 100 to 102; a student that sees
    /// the state was not tuned.
    #[must_use]
    pub fn of_task(task: Task, pixels: bool) -> Self {
        let settings = Self { fallen_below: task.has_object().then_some(0.3), ..Self::default() };
        let learning_rate = if pixels { 0.005 } else { settings.learning_rate };
        Self { learning_rate, ..settings }
    }

    /// Returns these settings with one changed, as
    /// [`TrainSettings::with`](crate::learn::TrainSettings::with) does.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn with(&self, assignment: &str) -> Result<Self, SettingError> {
        let (key, value) = assigned(assignment)?;
        let settings: Self = changed(self.to_json(), key, value)?;
        settings.check()?;
        Ok(settings)
    }

    pub(crate) fn to_json(&self) -> Value {
        json_of(self)
    }

    /// Checks the settings of a student.
    pub(super) fn check_for(&self, sees_pictures: bool) -> Result<(), TrainError> {
        let wrong = |name, value, expected| Err(TrainError::Setting { name, value, expected });
        if sees_pictures && self.relative_goal {
            let expected = "leave it false for a student that sees pictures";
            return wrong("relative_goal", "true".to_owned(), expected);
        }
        if sees_pictures && !self.left_out.is_empty() {
            let expected = "leave it empty for a student that sees pictures, and choose its fields";
            return wrong("left_out", format!("{:?}", self.left_out), expected);
        }
        self.check()
    }

    /// Returns how observations and goals become inputs.
    pub(super) fn inputs(&self) -> InputSettings {
        InputSettings {
            relative_goal: self.relative_goal,
            left_out: self.left_out.clone(),
            min_std: self.min_std,
            ..InputSettings::default()
        }
    }
}
