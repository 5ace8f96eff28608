//! What makes the environments of a command.

use baselines::OnMujoco;
use baselines::datasets::{DatasetError, Metadata};
use baselines::runs::MakeEnvs;
use fetch_env::{EnvId, RenderEnv};

/// Makes Fetch environments on MuJoCo: of the built-in tasks, or of the host's own. Everything that does
/// implements this trait.
pub trait Tasks: MakeEnvs<Env: OnMujoco + RenderEnv> {
    /// Returns the name of the first version of a set of an environment's episodes.
    fn set_name(&self, env_id: EnvId, set: &str) -> String {
        let own = |task| Metadata::name_of_own(task, set);
        self.task().map_or_else(|| Metadata::name_of(env_id, set), own)
    }

    /// Describes a data set.
    fn metadata(
        &self,
        name: &str,
        env: &Self::Env,
        policy: &str,
        command: &str,
    ) -> Result<Metadata, DatasetError> {
        match self.task() {
            None => Metadata::new(name, env, policy, command),
            Some(task) => Metadata::of_own_task(name, task, env, policy, command),
        }
    }
}

impl<M: MakeEnvs<Env: OnMujoco + RenderEnv>> Tasks for M {}
