//! The description of a data set.

use fetch_env::{EnvId, RewardKind, Space, Task};
use fetch_sim::{ModelSource, MujocoVersion};
use serde::Serialize;

use super::error::DatasetError;
use crate::on_mujoco::OnMujoco;

/// The description of a data set and its origin; each format writes it beside the episodes.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Metadata {
    /// Name with a version, such as `fetch/push/expert-v0`.
    pub name: String,
    /// Name of the environment.
    pub env_id: EnvId,
    /// Name of the task, if it is one of your own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub task: Option<String>,
    /// The model of the robot: `builtin` or `reference`; with a task of your own also `extended`,
    /// `folder` or `files`.
    pub model: &'static str,
    /// The policy that acted.
    pub policy: String,
    /// The command that makes the same data set again; empty if there is none.
    pub command: String,
    /// Version of this crate.
    pub version: &'static str,
    /// Version of MuJoCo, on which the bits of the states depend.
    pub mujoco: String,
    /// Maximum number of steps of an episode.
    pub max_episode_steps: u32,
    #[serde(skip)]
    pub(super) observation_space: Space,
    #[serde(skip)]
    pub(super) action_space: Space,
    #[serde(skip)]
    pub(super) states: [usize; 2],
}

impl Metadata {
    /// Describes a data set of an environment. Its name consists of letters, digits, `-` and `_`,
    /// in parts separated by `/`, and ends with a version: `fetch/push/expert-v0`.
    ///
    /// # Errors
    /// [`DatasetError::Name`] for any other name; [`DatasetError::Settings`] if the environment
    /// does not have the settings that its name stands for, with the built-in or the reference's
    /// model.
    pub fn new(
        name: &str,
        env: &impl OnMujoco,
        policy: impl Into<String>,
        command: impl Into<String>,
    ) -> Result<Self, DatasetError> {
        let metadata = Self::of(name, env, policy.into(), command.into())?;
        let (config, env_id) = (env.config(), metadata.env_id);
        let model = config.sim().model();
        let is_known = matches!(model, ModelSource::Builtin | ModelSource::Reference);
        if is_known && *config == env_id.config().with_model(model.clone()) {
            return Ok(metadata);
        }
        Err(DatasetError::Settings { env_id: env_id.to_string() })
    }

    /// Describes a data set of a task of your own. It has the spaces, but readers cannot make its
    /// environment, so any settings will do.
    ///
    /// # Errors
    /// [`DatasetError::Name`], as [`new`](Self::new).
    pub fn of_own_task(
        name: &str,
        task: impl Into<String>,
        env: &impl OnMujoco,
        policy: impl Into<String>,
        command: impl Into<String>,
    ) -> Result<Self, DatasetError> {
        let metadata = Self::of(name, env, policy.into(), command.into())?;
        Ok(Self { task: Some(task.into()), ..metadata })
    }

    fn of(
        name: &str,
        env: &impl OnMujoco,
        policy: String,
        command: String,
    ) -> Result<Self, DatasetError> {
        if !is_name(name) {
            return Err(DatasetError::Name { name: name.to_owned() });
        }
        let (config, data) = (env.config(), env.simulator().data());
        Ok(Self {
            name: name.to_owned(),
            env_id: EnvId { task: config.task(), reward: config.distance_reward().kind() },
            task: None,
            model: match config.sim().model() {
                ModelSource::Builtin => "builtin",
                ModelSource::Reference => "reference",
                ModelSource::Folder(_) => "folder",
                ModelSource::Extended(_) => "extended",
                _ => "files",
            },
            policy,
            command,
            version: env!("CARGO_PKG_VERSION"),
            mujoco: MujocoVersion::of_library()
                .map_or_else(|_| String::new(), |version| version.to_string()),
            max_episode_steps: config.max_episode_steps().get(),
            observation_space: env.observation_space().clone(),
            action_space: env.action_space().clone().into(),
            states: [data.qpos().len(), data.qvel().len()],
        })
    }

    /// Returns the name of the first version of a set, such as `fetch/push-dense/expert-v0`.
    #[must_use]
    pub fn name_of(env_id: EnvId, set: &str) -> String {
        let dense = match env_id.reward {
            RewardKind::Sparse => "",
            RewardKind::Dense => "-dense",
        };
        format!("fetch/{}{dense}/{set}-v0", scene(env_id.task).replace('_', "-"))
    }

    /// Returns the name of the first version of a set of a task of your own, such as
    /// `fetch/stack/mine-v0` of `examples.Stack`.
    #[must_use]
    pub fn name_of_own(task: &str, set: &str) -> String {
        let name = task.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        format!("fetch/{}/{set}-v0", name.replace(|c: char| !c.is_ascii_alphanumeric(), "-"))
    }

    /// Returns a sentence about the data set.
    #[cfg(feature = "minari")]
    pub(super) fn sentence(&self) -> String {
        let Self { env_id, policy, model, version, mujoco, .. } = self;
        let own = self.task.as_ref().map_or(String::new(), |task| format!("the task {task} in "));
        format!(
            "Episodes of {policy} in {own}{env_id} on the {model} model, by fetch-baselines {version} \
             on MuJoCo {mujoco}. The infos hold both rewards of each state and its exact qpos and \
             qvel."
        )
    }
}

/// Returns the name of a task's scene, which is also the name of gymnasium-robotics' module.
pub(super) fn scene(task: Task) -> &'static str {
    task.spec().scene_file.trim_end_matches(".xml")
}

/// Whether all formats can use a name.
fn is_name(name: &str) -> bool {
    let is_part = |part: &str| {
        !part.is_empty() && part.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_".contains(&b))
    };
    let version = name.rsplit_once("-v").map_or("", |(_, version)| version);
    let is_version = !version.is_empty() && version.bytes().all(|b| b.is_ascii_digit());
    is_version && name.split('/').all(is_part)
}
