//! The state of all environments, saved and restored.

use serde::{Deserialize, Serialize};

use super::env::{BatchEnv, VecEnv};
use crate::gym::{env::SnapshotEnv, np_random::MAX_COUNT, vec_env::error::VecEnvError};

/// Snapshot of a [`VecEnv`]: the state of each environment, and whether its autoreset is due.
///
/// `S` is an environment's own snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VecSnapshot<S> {
    envs: Vec<EnvState<S>>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct EnvState<S> {
    env: S,
    reset_is_due: bool,
    num_episodes: u64,
}

impl<E: BatchEnv + SnapshotEnv> VecEnv<E> {
    /// Returns the state of all environments.
    ///
    /// # Errors
    /// [`VecEnvError::InFlight`], or [`VecEnvError::OutOfUse`] if an environment has panicked.
    pub fn snapshot(&self) -> Result<VecSnapshot<E::Snapshot>, VecEnvError> {
        self.check_all_idle()?;
        let states = self.idle.iter().flatten().map(|slot| {
            let env =
                slot.env.as_ref().ok_or(VecEnvError::OutOfUse { env_index: slot.env_index })?;
            Ok(EnvState {
                env: env.snapshot(),
                reset_is_due: slot.reset_is_due,
                num_episodes: slot.num_episodes,
            })
        });
        Ok(VecSnapshot { envs: states.collect::<Result<_, VecEnvError>>()? })
    }

    /// Restores a snapshot of these environments or of ones made the same way. Afterwards the same
    /// actions give the same results, bit for bit. [`last_step`](Self::last_step) stays as it is
    /// until the next call.
    ///
    /// # Errors
    /// [`VecEnvError::InFlight`], [`VecEnvError::OutOfUse`], [`VecEnvError::Count`] if the snapshot
    /// is of another number of environments, or [`VecEnvError::ForeignSnapshot`]; nothing has
    /// changed then.
    pub fn restore(&mut self, snapshot: &VecSnapshot<E::Snapshot>) -> Result<(), VecEnvError> {
        let before = self.snapshot()?;
        let (actual, num_envs) = (snapshot.envs.len(), self.num_envs());
        if actual != num_envs {
            return Err(VecEnvError::Count { what: "snapshot", actual, num_envs });
        }
        self.restore_each(snapshot).inspect_err(|_| {
            // Each environment takes back its own state.
            let _ = self.restore_each(&before);
        })
    }

    fn restore_each(&mut self, snapshot: &VecSnapshot<E::Snapshot>) -> Result<(), VecEnvError> {
        for (slot, state) in self.idle.iter_mut().flatten().zip(&snapshot.envs) {
            let env_index = slot.env_index;
            let env = slot.env.as_mut().ok_or(VecEnvError::OutOfUse { env_index })?;
            let foreign = |reason| VecEnvError::ForeignSnapshot { env_index, reason };
            if state.num_episodes > MAX_COUNT {
                return Err(foreign(format!("{} episodes have not begun", state.num_episodes)));
            }
            env.restore(&state.env).map_err(|error| foreign(error.to_string()))?;
            slot.reset_is_due = state.reset_is_due;
            slot.num_episodes = state.num_episodes;
        }
        Ok(())
    }
}
