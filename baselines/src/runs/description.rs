//! The description of a run: `run.json`.

use std::num::NonZeroU64;
use std::path::{Path, PathBuf};

use fetch_env::{EnvId, FetchConfig, ModelSource};
use her_relabel::files::read_text;
use serde::{Deserialize, Serialize};

use super::envs::MakeEnvs;
use super::error::{FolderError, RunsError};
use crate::learn::{DistillSettings, Preset, TrainSettings, each_setting, limits};
#[cfg(feature = "render")]
use crate::trained::Sight;

/// The name of the file.
pub(super) const RUN: &str = "run.json";

/// The largest size of a description, in bytes.
pub(super) const LIMIT: u64 = 1 << 20;

/// What a resumed run needs besides its checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct RunDescription {
    /// The environment.
    pub env_id: EnvId,
    /// The name of the task, if it is [not built in](super::MakeEnvs::task).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub task: Option<String>,
    /// The model of the robot.
    pub model: RunModel,
    /// The settings of the environment, except its model, if they are not the reference's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub config: Option<FetchConfig>,
    /// Environment steps after which the run ends.
    pub steps: u64,
    /// Updates after which the run ends, if it learns only from demonstrations.
    pub updates: Option<NonZeroU64>,
    /// Success rate at which the run ends; more than 1 for none.
    pub target: f64,
    /// The seed.
    pub seed: u64,
    /// The settings of the learner that it started from; none for a run with a teacher.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<Preset>,
    /// Whom a student imitates, if it is a run with a teacher.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub teacher: Option<RunTeacher>,
    /// What the policy sees, if it sees pictures.
    #[cfg(feature = "render")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sight: Option<Sight>,
    /// Where the demonstrations come from: a number of scripted episodes, or a file.
    pub demos: Option<String>,
    /// The policy that the run started from, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<String>,
    /// What differs from the preset and from the environment's own settings, such as `gamma=0.98`.
    pub changes: Vec<String>,
}

/// The model of the robot in a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RunModel {
    /// [`ModelSource::Builtin`].
    Builtin,
    /// [`ModelSource::Reference`].
    Reference,
    /// [`ModelSource::Folder`].
    Folder(PathBuf),
}

/// The teacher of a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RunTeacher {
    /// The task's [`ScriptedPolicy`](crate::ScriptedPolicy).
    Scripted,
    /// A policy, which is in the folder: its environment, its seed and its steps.
    Policy(String),
}

impl RunModel {
    /// Returns the source of the model.
    #[must_use]
    pub fn source(&self) -> ModelSource {
        match self {
            Self::Builtin => ModelSource::Builtin,
            Self::Reference => ModelSource::Reference,
            Self::Folder(folder) => ModelSource::Folder(folder.clone()),
        }
    }
}

impl RunDescription {
    /// Describes a run with the default [limits] of its task, on the built-in model,
    /// without demonstrations or changes.
    #[must_use]
    pub const fn new(env_id: EnvId, preset: Preset, seed: u64) -> Self {
        let (steps, target) = limits(env_id.task);
        Self {
            env_id,
            task: None,
            model: RunModel::Builtin,
            config: None,
            steps,
            updates: None,
            target,
            seed,
            preset: Some(preset),
            teacher: None,
            #[cfg(feature = "render")]
            sight: None,
            demos: None,
            start: None,
            changes: Vec::new(),
        }
    }

    /// Describes a run with these settings of the environment, whose own model is left out, and of
    /// the learner, with the default [limits] of its task. The preset is the one from which the
    /// settings differ least.
    #[must_use]
    pub fn of_settings(
        env_id: EnvId,
        model: RunModel,
        config: FetchConfig,
        settings: &TrainSettings,
        seed: u64,
    ) -> Self {
        let of_presets = Preset::ALL.map(|preset| {
            let of_preset = preset.settings(env_id.task);
            let of_preset = match settings.pixels {
                Some(_) => of_preset.with_pixels(env_id.task),
                None => of_preset,
            };
            (preset, differences(settings, &of_preset))
        });
        let nearest = of_presets.into_iter().min_by_key(|(_, changes)| changes.len());
        let (preset, changes) = nearest.unwrap_or((Preset::Fast, Vec::new()));
        Self::new(env_id, preset, seed).with_changes(model, config, changes)
    }

    /// Describes a run with a teacher, and with these settings of the environment, whose own model is
    /// left out. Its student sees the state, or the pictures of [`sight`](Self::sight) if you set it.
    /// The run ends with the default success rate of its task, or after at most 100,000 steps. Its
    /// teacher and its changes are set when it [begins](super::NewStudent::begin).
    #[must_use]
    pub fn of_student(env_id: EnvId, model: RunModel, config: FetchConfig, seed: u64) -> Self {
        let run = Self::new(env_id, Preset::Fast, seed);
        let run = Self { preset: None, steps: run.steps.min(100_000), ..run };
        run.with_changes(model, config, Vec::new())
    }

    /// Sets the teacher, and what differs from the settings that students of the task have.
    pub(super) fn with_teacher(self, teacher: RunTeacher, settings: &DistillSettings) -> Self {
        #[cfg(feature = "render")]
        let pixels = self.sight.is_some();
        #[cfg(not(feature = "render"))]
        let pixels = false;
        let mut changes =
            differences(settings, &DistillSettings::of_task(self.env_id.task, pixels));
        changes.extend(self.changes);
        Self { teacher: Some(teacher), changes, ..self }
    }

    /// Sets the model and the settings of the environment, with what differs from its own.
    fn with_changes(self, model: RunModel, config: FetchConfig, mut changes: Vec<String>) -> Self {
        match &model {
            RunModel::Builtin => {}
            RunModel::Reference => changes.push("reference".to_owned()),
            RunModel::Folder(folder) => changes.push(format!("model={}", folder.display())),
        }
        let (config, own) = (config.with_model(ModelSource::Builtin), self.env_id.config());
        changes.extend(differences(&config, &own));
        let config = (config != own).then_some(config);
        Self { model, config, changes, ..self }
    }

    /// Reads the description of the run in a folder.
    ///
    /// # Errors
    /// [`FolderError::NotARun`] and [`FolderError::Damaged`].
    pub fn read(folder: impl AsRef<Path>) -> Result<Self, FolderError> {
        let folder = folder.as_ref();
        let path = folder.join(RUN);
        let text = read_text(&path, LIMIT)
            .map_err(|source| FolderError::NotARun { folder: folder.to_owned(), source })?;
        serde_json::from_slice(text.as_bytes())
            .map_err(|source| FolderError::Damaged { path, source })
    }

    /// Returns the settings of the environment.
    pub fn config(&self) -> FetchConfig {
        let config = self.config.clone().unwrap_or_else(|| self.env_id.config());
        config.with_model(self.model.source())
    }

    /// Returns the name of the task, or of the environment.
    #[must_use]
    pub fn title(&self) -> String {
        self.task.clone().unwrap_or_else(|| self.env_id.to_string())
    }

    /// Returns the name of the runs that differ only in their seeds, such as `FetchPush-v4-fast`:
    /// the beginning of the names of files.
    #[must_use]
    pub fn group(&self) -> String {
        // The dash between parts is escaped.
        let part = |key, text: &str| format!("{key}={}", file_name(text).replace('-', "%2D"));
        // A number of episodes, or the name of their file.
        let demos = self.demos.as_ref().map(|demos| {
            let stem = Path::new(demos).file_stem().unwrap_or(demos.as_ref());
            part("demos", &stem.to_string_lossy())
        });
        let start = self.start.iter().map(|start| part("start", start));
        let teacher = self.teacher.iter().map(|teacher| match teacher {
            RunTeacher::Scripted => part("teacher", "scripted"),
            RunTeacher::Policy(policy) => {
                // Its own task's name would be there twice.
                let own = format!("{}, ", self.env_id);
                let policy = policy.strip_prefix(&own).unwrap_or(policy);
                part("teacher", &policy.replace(", ", "_").replace(' ', "_"))
            }
        });
        #[cfg(feature = "render")]
        let sight = self.sight.iter().map(|sight| sight.name(self.env_id.task));
        #[cfg(not(feature = "render"))]
        let sight = None::<String>.into_iter();
        let changes = self.changes.iter().map(|change| file_name(change));
        let task = self.task.iter().map(|task| format!("task={}", file_name(task)));
        let learner = self.preset.map_or("distilled", Preset::name).to_owned();
        let parts = [file_name(&self.env_id.to_string()), learner];
        parts
            .into_iter()
            .chain(task)
            .chain(demos)
            .chain(start)
            .chain(teacher)
            .chain(sight)
            .chain(changes)
            .collect::<Vec<_>>()
            .join("-")
    }

    /// Checks that environments are of the task of the run in a folder.
    pub(super) fn check_task(&self, tasks: &impl MakeEnvs, folder: &Path) -> Result<(), RunsError> {
        if self.task.as_deref() == tasks.task() {
            return Ok(());
        }
        Err(RunsError::OtherTask { folder: folder.to_owned(), task: self.title() })
    }

    /// Checks that the run in a folder, which this describes, has the environment of another one.
    pub(super) fn check_environment(&self, other: &Self, folder: &Path) -> Result<(), RunsError> {
        if self.config() == other.config() {
            return Ok(());
        }
        let what = match self.env_id == other.env_id {
            true => "other settings of the environment".to_owned(),
            false => format!("the environment {}", self.env_id),
        };
        Err(RunsError::other(folder, &what))
    }

    /// Whether two runs may have the same name.
    #[must_use]
    pub fn differs_in_seed_alone(&self, other: &Self) -> bool {
        let same = |run: &Self| Self { seed: 0, steps: 0, target: 0.0, ..run.clone() };
        same(self) == same(other)
    }
}

/// Returns the settings that differ from others, such as `gamma=0.98`.
fn differences<T: Serialize>(settings: &T, others: &T) -> Vec<String> {
    let others = each_setting(others);
    let all = each_setting(settings).into_iter();
    all.filter(|setting| !others.contains(setting))
        .map(|(name, value)| format!("{name}={value}"))
        .collect()
}

/// Returns a text as part of a file name: characters with a meaning there become `%` and their
/// code, as in URLs.
pub(super) fn file_name(text: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"=.,_-[]".contains(&byte);
    let escaped = |byte: u8| match is_plain(byte) {
        true => char::from(byte).to_string(),
        false => format!("%{byte:02X}"),
    };
    text.bytes().map(escaped).collect()
}
