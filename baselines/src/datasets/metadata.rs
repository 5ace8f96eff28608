//! The description of a data set.

use fetch_env::{Env, EnvId, MujocoEnv, RewardKind, Space, Task};
use fetch_sim::{ModelSource, MujocoVersion};
use serde::Serialize;

use super::error::DatasetError;

/// The description of a data set and its origin; each format writes it beside the episodes.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Metadata {
    /// Name with a version, such as `fetch/push/expert-v0`.
    pub name: String,
    /// Name of the environment.
    pub env_id: EnvId,
    /// The model of the robot: `builtin` or `reference`.
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
        env: &MujocoEnv,
        policy: impl Into<String>,
        command: impl Into<String>,
    ) -> Result<Self, DatasetError> {
        if !is_name(name) {
            return Err(DatasetError::Name { name: name.to_owned() });
        }
        let config = env.inner().config();
        let env_id = EnvId { task: config.task(), reward: config.distance_reward().kind() };
        let model = match config.sim().model() {
            ModelSource::Builtin => "builtin",
            ModelSource::Reference => "reference",
            _ => "",
        };
        if model.is_empty() || *config != env_id.config().with_model(config.sim().model().clone()) {
            return Err(DatasetError::Settings { env_id: env_id.to_string() });
        }
        let data = env.inner().simulator().data();
        Ok(Self {
            name: name.to_owned(),
            env_id,
            model,
            policy: policy.into(),
            command: command.into(),
            version: env!("CARGO_PKG_VERSION"),
            mujoco: MujocoVersion::of_library()
                .map_or_else(|_| String::new(), |version| version.to_string()),
            max_episode_steps: env.max_episode_steps().get(),
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

    /// Returns a sentence about the data set.
    #[cfg(feature = "minari")]
    pub(super) fn sentence(&self) -> String {
        let Self { env_id, policy, model, version, mujoco, .. } = self;
        format!(
            "Episodes of {policy} in {env_id} on the {model} model, by fetch-baselines {version} \
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
