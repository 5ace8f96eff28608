//! Snapshots of environments that are stepped together.

use super::config::AutoresetMode;
use super::env::VecEnv;
use super::error::VecEnvError;
use super::step::VecStepOf;
use crate::gym::env::action_space::ActionSpace;
use crate::gym::env::{SnapshotEnv, WrappedSnapshot, observation::BatchObservation};
use crate::gym::np_random::MAX_COUNT;

impl<E: SnapshotEnv<Observation: BatchObservation> + Send + 'static> VecEnv<E> {
    /// Returns the states of all environments, each with the number of episodes that it has begun
    /// and whether an autoreset is due.
    ///
    /// # Errors
    /// [`VecEnvError::InFlight`], or [`VecEnvError::OutOfUse`] if an environment has panicked.
    pub fn snapshot(&self) -> Result<Vec<WrappedSnapshot<E::Snapshot, u64>>, VecEnvError> {
        self.check_all_idle()?;
        let states = self.idle.iter().flatten().map(|slot| {
            let env =
                slot.env.as_ref().ok_or(VecEnvError::OutOfUse { env_index: slot.env_index })?;
            Ok(WrappedSnapshot {
                env: env.snapshot(),
                wrapper: slot.num_episodes,
                reset_needed: slot.reset_is_due,
            })
        });
        states.collect()
    }

    /// Restores a snapshot of these environments or of ones made the same way. Afterwards the same
    /// actions give the same results, bit for bit.
    ///
    /// [`last_step`](Self::last_step) then has the restored observations, as rows in which episodes
    /// start: a replay buffer that records them does not join what was before to what comes next.
    /// They are NaN where the environment does not know its
    /// [last one](SnapshotEnv::last_observation).
    ///
    /// # Errors
    /// [`VecEnvError::InFlight`], [`VecEnvError::OutOfUse`], [`VecEnvError::Count`] if the snapshot
    /// has another number of environments, or [`VecEnvError::ForeignSnapshot`]; nothing has changed
    /// then.
    pub fn restore(
        &mut self,
        snapshot: &[WrappedSnapshot<E::Snapshot, u64>],
    ) -> Result<(), VecEnvError> {
        let before = self.snapshot()?;
        let (actual, num_envs) = (snapshot.len(), self.num_envs());
        if actual != num_envs {
            return Err(VecEnvError::Count { what: "snapshot", actual, num_envs });
        }
        self.restore_each(snapshot).inspect_err(|_| {
            // Each environment takes back its own state.
            let _ = self.restore_each(&before);
        })?;
        self.show_restored()
    }

    /// Replaces the rows, which are those of the time before.
    fn show_restored(&mut self) -> Result<(), VecEnvError> {
        let (space, action_len) = (&self.observation_space, self.action_space.action_len());
        let keeps_last = self.autoreset == AutoresetMode::SameStep;
        for slot in self.idle.iter_mut().flatten() {
            let mut row = VecStepOf::<E>::new(space, action_len, keeps_last, 1)?;
            row.begin();
            row.count_after(&slot.row);
            slot.row = row;
            if let Some(observation) = slot.env.as_ref().and_then(E::last_observation)
                && let Err(error) = slot.row.set_start(&observation, None)
            {
                slot.row.set_error(error, false);
            }
        }
        self.receive_all().map(|_| ())
    }

    fn restore_each(
        &mut self,
        snapshot: &[WrappedSnapshot<E::Snapshot, u64>],
    ) -> Result<(), VecEnvError> {
        for (slot, state) in self.idle.iter_mut().flatten().zip(snapshot) {
            let env_index = slot.env_index;
            let env = slot.env.as_mut().ok_or(VecEnvError::OutOfUse { env_index })?;
            let foreign = |reason| VecEnvError::ForeignSnapshot { env_index, reason };
            if state.wrapper > MAX_COUNT {
                return Err(foreign(format!("{} episodes cannot have begun", state.wrapper)));
            }
            env.restore(&state.env).map_err(|error| foreign(error.to_string()))?;
            slot.was_reset = state.wrapper > 0;
            slot.reset_is_due = state.reset_needed;
            slot.num_episodes = state.wrapper;
        }
        Ok(())
    }
}
