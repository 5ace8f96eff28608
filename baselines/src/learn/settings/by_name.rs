//! Presets and settings by name, as on a command line or in a file.

use std::fmt;
use std::str::FromStr;

use fetch_env::Task;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;

use super::train::TrainSettings;
use crate::learn::error::TrainError;

/// A preset: settings found for the Fetch tasks.
///
/// ```
/// use baselines::learn::{Preset, TrainSettings};
/// use fetch_env::Task;
///
/// let preset: Preset = "fast".parse()?;
/// let settings = preset.settings(Task::Push).with("gamma=0.98")?;
/// assert_ne!(settings, TrainSettings::fast(Task::Push));
/// let error = settings.with("gama=0.98").unwrap_err();
/// assert!(error.to_string().starts_with("there is no setting gama; did you mean gamma?"));
/// # Ok::<(), baselines::learn::SettingError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Preset {
    /// [`TrainSettings::authors`].
    Authors,
    /// [`TrainSettings::book`].
    Book,
    /// [`TrainSettings::book_ppo`].
    BookPpo,
    /// [`TrainSettings::fast`].
    Fast,
    /// [`TrainSettings::fast_ppo`].
    FastPpo,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 5] =
        [Self::Authors, Self::Book, Self::BookPpo, Self::Fast, Self::FastPpo];

    /// Returns the name: `authors`, `book`, `book-ppo`, `fast` or `fast-ppo`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Authors => "authors",
            Self::Book => "book",
            Self::BookPpo => "book-ppo",
            Self::Fast => "fast",
            Self::FastPpo => "fast-ppo",
        }
    }

    /// Returns the settings that the preset has for a task.
    #[must_use]
    pub fn settings(self, task: Task) -> TrainSettings {
        match self {
            Self::Authors => TrainSettings::authors(),
            Self::Book => TrainSettings::book(task),
            Self::BookPpo => TrainSettings::book_ppo(),
            Self::Fast => TrainSettings::fast(task),
            Self::FastPpo => TrainSettings::fast_ppo(),
        }
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Preset {
    type Err = SettingError;

    fn from_str(name: &str) -> Result<Self, SettingError> {
        let found = Self::ALL.into_iter().find(|preset| preset.name() == name);
        found.ok_or_else(|| SettingError::NoPreset {
            name: name.to_owned(),
            nearest: nearest(Self::ALL.into_iter().map(Self::name), name).to_owned(),
        })
    }
}

impl TrainSettings {
    /// Returns these settings with one changed, written as `KEY=VALUE`: the value is JSON, such as
    /// `gamma=0.98`, `hidden=[256,256]` or `relative_goal=true`, or a word, as in
    /// `goal_strategy=final`.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn with(&self, assignment: &str) -> Result<Self, SettingError> {
        let (key, value) = assigned(assignment)?;
        self.with_value(key, value)
    }

    /// Returns these settings with the one of this name changed.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn with_value(&self, key: &str, to: Value) -> Result<Self, SettingError> {
        let changed: Self = changed(self.to_json(), key, to)?;
        changed.check()?;
        Ok(changed)
    }

    /// Reads settings from JSON. A setting that it lacks, as one of an earlier version may, has its
    /// default.
    ///
    /// # Errors
    /// [`SettingError::Json`], and [`SettingError::Range`] if one is out of its range.
    pub fn from_json(json: &str) -> Result<Self, SettingError> {
        let settings: Self = serde_json::from_slice(json.as_bytes()).map_err(SettingError::Json)?;
        settings.check()?;
        Ok(settings)
    }
}

/// Returns the number of steps and the success rate at which a run of a task ends unless it is told
/// otherwise.
#[must_use]
pub const fn limits(task: Task) -> (u64, f64) {
    match task {
        Task::Reach => (10_000, 1.0),
        Task::Push => (500_000, 0.9),
        Task::PickAndPlace => (1_500_000, 0.9),
        Task::Slide => (4_000_000, 0.7),
    }
}

/// Returns the key and the value of an assignment.
pub(crate) fn assigned(assignment: &str) -> Result<(&str, Value), SettingError> {
    let (key, text) = assignment.split_once('=').ok_or(SettingError::NoAssignment)?;
    let is_word = text.bytes().all(|byte| byte.is_ascii_lowercase());
    match serde_json::from_str(text) {
        Ok(value) => Ok((key, value)),
        Err(_) if is_word => Ok((key, Value::String(text.to_owned()))),
        Err(_) => Err(SettingError::NoValue { text: text.to_owned() }),
    }
}

/// Returns settings with the one of this name changed, not yet checked.
pub(crate) fn changed<T: DeserializeOwned>(
    mut all: Value,
    key: &str,
    to: Value,
) -> Result<T, SettingError> {
    let Some(place) = find(&mut all, key) else {
        let names = names(&all);
        let nearest = nearest(names.iter().map(String::as_str), key).to_owned();
        return Err(SettingError::NoSetting { key: key.to_owned(), nearest, names });
    };
    let value = to.to_string();
    *place = to;
    serde_json::from_value(all).map_err(|error| {
        let (key, reason) = (key.to_owned(), error.to_string());
        SettingError::Value { key, value, reason }
    })
}

/// Returns the place of a setting in the tree of all.
fn find<'a>(value: &'a mut Value, key: &str) -> Option<&'a mut Value> {
    let Value::Object(entries) = value else { return None };
    let is_setting = entries.get(key).is_some_and(|value| !value.is_object());
    if is_setting {
        entries.get_mut(key)
    } else {
        entries.values_mut().find_map(|value| find(value, key))
    }
}

/// Returns the names of all settings.
fn names(value: &Value) -> Vec<String> {
    let entries = value.as_object().into_iter().flatten();
    let names = entries.map(|(name, value)| match value {
        Value::Object(_) => names(value),
        _ => vec![name.clone()],
    });
    names.flatten().collect()
}

/// Returns the names of all presets.
fn preset_names() -> String {
    Preset::ALL.map(Preset::name).join(", ")
}

/// Returns the nearest of some names, for an error that suggests it; nothing if there are none.
#[must_use]
pub fn nearest<'a>(names: impl Iterator<Item = &'a str>, to: &str) -> &'a str {
    let nearness = |name: &str| strsim::jaro_winkler(name, to);
    names.max_by(|a, b| nearness(a).total_cmp(&nearness(b))).unwrap_or_default()
}

/// Error returned when a preset or a setting is not what its name says.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum SettingError {
    /// There is no such preset.
    #[error("there is no preset {name}; did you mean {nearest}? All are: {}", preset_names())]
    NoPreset {
        /// The name.
        name: String,
        /// The nearest name of a preset.
        nearest: String,
    },
    /// There is no such setting.
    #[error("there is no setting {key}; did you mean {nearest}? All are: {}", names.join(", "))]
    NoSetting {
        /// The name.
        key: String,
        /// The nearest name of a setting.
        nearest: String,
        /// The names of all settings.
        names: Vec<String>,
    },
    /// A text does not assign a value to a setting.
    #[error("write KEY=VALUE, such as gamma=0.98")]
    NoAssignment,
    /// The value is neither JSON nor a word.
    #[error("{text} is not a number, a list, true or a word")]
    NoValue {
        /// The text.
        text: String,
    },
    /// The setting has values of another kind.
    #[error("{value} is not a value of {key}: {reason}")]
    Value {
        /// The name of the setting.
        key: String,
        /// The value.
        value: String,
        /// What is wrong with it.
        reason: String,
    },
    /// JSON does not have the settings of a run.
    #[error("these are not settings of the learner")]
    Json(#[source] serde_json::Error),
    /// The value is out of its range.
    #[error(transparent)]
    Range(#[from] TrainError),
}

debug_as_display!(SettingError);
