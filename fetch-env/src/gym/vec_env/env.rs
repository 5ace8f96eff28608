//! The vector environment: what it sends to its threads and receives from them.

mod begin;

use std::{fmt, sync::Arc};

use super::config::{AutoresetMode, MAX_ENVS, VecConfig, VecReset, check_num_envs};
use super::pool::{Place, Pool};
use super::slot::Slot;
use super::source::unique_number;
use super::step::VecStepOf;
use crate::gym::env::action_space::ActionSpace;
use crate::gym::env::observation::BatchObservation;
use crate::gym::env::{ActionElement, Env};
use crate::gym::spaces::Space;
use crate::gym::vec_env::error::VecEnvError;

/// Environments that are stepped together; see the [module](super).
pub struct VecEnv<E: Env<Observation: BatchObservation>> {
    /// By id; `None` while an environment is in flight.
    pub(super) idle: Vec<Option<Box<Slot<E>>>>,
    pool: Pool<Slot<E>>,
    in_flight: usize,
    pub(super) step: VecStepOf<E>,
    pub(super) autoreset: AutoresetMode,
    pub(super) action_space: E::ActionSpace,
    pub(super) observation_space: Space,
    /// The last call that named each id, to detect an id named twice in one call.
    named_in: Vec<u64>,
    calls: u64,
}

impl<E: Env<Observation: BatchObservation> + Send + 'static> VecEnv<E> {
    /// Creates a vector of environments, with the ids 0, 1, ... in order, and starts its threads.
    ///
    /// # Errors
    /// [`VecEnvError::NoEnvs`], or [`VecEnvError::TooManyEnvs`] beyond 65,536;
    /// [`VecEnvError::TooManyThreads`] beyond 1,024;
    /// [`SpaceError::MissingPart`](crate::spaces::SpaceError::MissingPart) or
    /// [`VecEnvError::SpacesDiffer`] if the environments cannot share the rows of a
    /// [`VecStep`](super::VecStep); [`VecEnvError::Thread`] or [`VecEnvError::Pinning`] if the
    /// operating system refuses.
    pub fn new(envs: impl IntoIterator<Item = E>, config: VecConfig) -> Result<Self, VecEnvError> {
        // One too many is enough to refuse them, even if the iterator never ends.
        let envs: Vec<E> = envs.into_iter().take(MAX_ENVS + 1).collect();
        check_num_envs(envs.len())?;
        let first = envs.first().ok_or(VecEnvError::NoEnvs)?;
        let (action_space, observation_space) =
            (first.action_space().clone(), first.observation_space().clone());
        for (env_index, env) in envs.iter().enumerate() {
            if *env.action_space() != action_space || *env.observation_space() != observation_space
            {
                return Err(VecEnvError::SpacesDiffer { env_index });
            }
        }
        let (num_envs, autoreset) = (envs.len(), config.autoreset());
        let threads = config.threads_for(num_envs)?;
        let keeps_last = autoreset == AutoresetMode::SameStep;
        let action_len = action_space.action_len();
        let rows = |len| VecStepOf::<E>::new(&observation_space, action_len, keeps_last, len);
        let slot =
            |(env_index, env)| Ok(Some(Box::new(Slot::new(env_index, env, autoreset, rows(1)?))));
        Ok(Self {
            idle: envs.into_iter().enumerate().map(slot).collect::<Result<_, VecEnvError>>()?,
            pool: Pool::new(threads, num_envs, config.pin_threads())?,
            in_flight: 0,
            step: rows(num_envs)?.with_source(unique_number()),
            autoreset,
            action_space,
            observation_space,
            named_in: vec![0; num_envs],
            calls: 0,
        })
    }

    /// Sets a function that chooses the seed and the options of every episode that an autoreset
    /// begins: for curricula, or to begin the same episodes on any number of threads. It takes the
    /// index of the environment and the number of episodes that this environment has begun before,
    /// by any reset. The default continues the environment's random numbers with default options.
    ///
    /// The worker threads call it. Its results are reproducible if they depend on nothing but its
    /// arguments.
    ///
    /// # Errors
    /// [`VecEnvError::InFlight`].
    ///
    /// ```
    /// use fetch_env::{FetchResetOptions, make_kinematic_vec, vec_env::VecConfig};
    ///
    /// let mut envs = make_kinematic_vec("FetchReach-v4", 4, VecConfig::default())?;
    /// envs.set_autoreset_start(|env_index, episode| {
    ///     (Some(4 * episode + env_index as u64), FetchResetOptions::default())
    /// })?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn set_autoreset_start(
        &mut self,
        choose: impl Fn(usize, u64) -> (Option<u64>, E::ResetOptions) + Send + Sync + 'static,
    ) -> Result<(), VecEnvError> {
        self.check_all_idle()?;
        let choose = Arc::new(choose);
        for slot in self.idle.iter_mut().flatten() {
            slot.choose_start = Some(Arc::clone(&choose) as _);
        }
        Ok(())
    }

    /// Returns the number of environments.
    #[must_use]
    pub fn num_envs(&self) -> usize {
        self.idle.len()
    }

    /// Returns how many episodes an environment has begun, by any reset; `None` for one in flight, or
    /// if there is none of this index.
    #[must_use]
    pub fn num_episodes(&self, env_index: usize) -> Option<u64> {
        self.idle.get(env_index)?.as_ref().map(|slot| slot.num_episodes)
    }

    /// Returns the number of worker threads.
    #[must_use]
    pub fn num_threads(&self) -> usize {
        self.pool.threads()
    }

    /// Returns when the next episode of an environment starts.
    #[must_use]
    pub const fn autoreset_mode(&self) -> AutoresetMode {
        self.autoreset
    }

    /// Returns the action space of each environment.
    #[must_use]
    pub const fn single_action_space(&self) -> &E::ActionSpace {
        &self.action_space
    }

    /// Returns the observation space of each environment.
    #[must_use]
    pub const fn single_observation_space(&self) -> &Space {
        &self.observation_space
    }

    /// Returns the number of environments in flight: sent to and not yet received.
    #[must_use]
    pub const fn in_flight(&self) -> usize {
        self.in_flight
    }

    /// Returns an environment for inspection; `None` if the id is unknown, or if the environment is
    /// in flight or has panicked.
    #[must_use]
    pub fn env(&self, env_index: usize) -> Option<&E> {
        self.idle.get(env_index)?.as_ref()?.env.as_ref()
    }

    /// Returns an environment for changing it; `None` where [`env`](Self::env) returns `None`.
    ///
    /// The vector does not notice resets and steps made here: its next step has the results of the
    /// next call, an autoreset that is due stays due, and the first reset is still needed. A replay
    /// buffer does not notice them either, so reset the vector before recording on. A goal may move
    /// without a reset, as by [`MovingGoal`](crate::MovingGoal): the next step's row has it, and a
    /// buffer records the steps before and after it as two episodes.
    #[must_use]
    pub fn env_mut(&mut self, env_index: usize) -> Option<&mut E> {
        self.idle.get_mut(env_index)?.as_mut()?.env.as_mut()
    }

    /// Returns the results of the last call of [`step`](Self::step), [`reset`](Self::reset) or
    /// [`recv`](Self::recv), or the states that were [restored](Self::restore) since.
    #[must_use]
    pub const fn last_step(&self) -> &VecStepOf<E> {
        &self.step
    }

    /// Resets all environments: the first with `seed`, the next with `seed + 1`, and so on.
    ///
    /// # Errors
    /// [`VecEnvError::InFlight`], and as [`send_reset`](Self::send_reset).
    pub fn reset(&mut self, seed: Option<u64>) -> Result<&VecStepOf<E>, VecEnvError> {
        self.check_all_idle()?;
        self.begin_seeded(seed, self.place())?;
        self.receive_all()
    }

    /// Resets the environments that the mask selects. The rows of the others have their last results
    /// again, but no step, and no end of an episode.
    ///
    /// # Errors
    /// [`VecEnvError::InFlight`], and as [`send_reset_with`](Self::send_reset_with).
    pub fn reset_with(
        &mut self,
        reset: &VecReset<'_, E::ResetOptions>,
    ) -> Result<&VecStepOf<E>, VecEnvError> {
        self.check_all_idle()?;
        self.begin_chosen(reset, self.place())?;
        self.receive_all()
    }

    /// Takes one action in every environment: row `i` of `actions` in environment `i`.
    ///
    /// # Errors
    /// [`VecEnvError::ResetNeeded`] before the first reset, [`VecEnvError::ActionCount`],
    /// [`VecEnvError::InFlight`] or [`VecEnvError::WorkerLost`]; then no environment has taken a
    /// step. The error of a single environment is in its row.
    pub fn step(&mut self, actions: &[ActionElement<E>]) -> Result<&VecStepOf<E>, VecEnvError> {
        self.check_all_idle()?;
        self.check_actions(actions, self.num_envs())?;
        self.idle.iter().flatten().try_for_each(|slot| slot.check_reset())?;
        let place = self.place();
        for env_index in 0..self.num_envs() {
            self.begin_step(env_index, actions, env_index, place);
        }
        self.wake(place);
        self.receive_all()
    }

    /// Starts a step in some environments: row `k` of `actions` in environment `env_index[k]`.
    ///
    /// # Errors
    /// [`VecEnvError::ResetNeeded`] for an environment that was never reset,
    /// [`VecEnvError::ActionCount`], [`VecEnvError::UnknownEnv`], [`VecEnvError::EnvInFlight`] or
    /// [`VecEnvError::WorkerLost`]; then no step is started.
    pub fn send(
        &mut self,
        actions: &[ActionElement<E>],
        env_index: &[usize],
    ) -> Result<(), VecEnvError> {
        self.pool.check()?;
        self.check_actions(actions, env_index.len())?;
        self.calls += 1;
        for &env_index in env_index {
            let num_envs = self.num_envs();
            let slot =
                self.idle.get(env_index).ok_or(VecEnvError::UnknownEnv { env_index, num_envs })?;
            let slot = slot.as_ref().filter(|_| self.named_in[env_index] != self.calls);
            slot.ok_or(VecEnvError::EnvInFlight { env_index })?.check_reset()?;
            self.named_in[env_index] = self.calls;
        }
        for (row, &env_index) in env_index.iter().enumerate() {
            self.begin_step(row, actions, env_index, Place::Threads);
        }
        self.wake(Place::Threads);
        Ok(())
    }

    /// Starts a reset of all environments: the first with `seed`, the next with `seed + 1`, and so
    /// on.
    ///
    /// # Errors
    /// [`VecEnvError::SeedTooLarge`], [`VecEnvError::EnvInFlight`] or [`VecEnvError::WorkerLost`];
    /// then no reset is started.
    pub fn send_reset(&mut self, seed: Option<u64>) -> Result<(), VecEnvError> {
        self.begin_seeded(seed, Place::Threads)
    }

    /// Starts a reset of the environments that the mask selects.
    ///
    /// # Errors
    /// [`VecEnvError::Count`], [`VecEnvError::EmptyMask`], [`VecEnvError::EnvInFlight`] or
    /// [`VecEnvError::WorkerLost`]; then no reset is started.
    pub fn send_reset_with(
        &mut self,
        reset: &VecReset<'_, E::ResetOptions>,
    ) -> Result<(), VecEnvError> {
        self.begin_chosen(reset, Place::Threads)
    }

    /// Waits for the first `batch_size` environments that finish.
    ///
    /// # Errors
    /// [`VecEnvError::BatchTooLarge`] if fewer are in flight; [`VecEnvError::WorkerLost`].
    pub fn recv(&mut self, batch_size: usize) -> Result<&VecStepOf<E>, VecEnvError> {
        self.pool.check()?;
        if batch_size > self.in_flight {
            return Err(VecEnvError::BatchTooLarge { batch_size, in_flight: self.in_flight });
        }
        self.pool.wait(batch_size)?;
        self.step.clear();
        while self.step.len() < batch_size
            && let Some(mut slot) = self.pool.take()
        {
            self.step.push(slot.env_index, &slot.row);
            slot.row.collected();
            self.take_back(slot);
        }
        Ok(&self.step)
    }

    /// Waits for all environments in flight. Row `i` of the result is environment `i`, as after
    /// [`step`](Self::step); the row of one that was not in flight has its last results again, but
    /// no step, and no end of an episode.
    ///
    /// # Errors
    /// [`VecEnvError::WorkerLost`] or [`VecEnvError::Forked`].
    pub fn recv_all(&mut self) -> Result<&VecStepOf<E>, VecEnvError> {
        self.pool.check()?;
        self.receive_all()
    }

    pub(super) fn receive_all(&mut self) -> Result<&VecStepOf<E>, VecEnvError> {
        self.pool.wait(self.in_flight)?;
        while let Some(slot) = self.pool.take() {
            self.take_back(slot);
        }
        self.step.clear();
        for slot in self.idle.iter_mut().flatten() {
            self.step.push(slot.env_index, &slot.row);
            slot.row.collected();
        }
        Ok(&self.step)
    }

    fn take_back(&mut self, slot: Box<Slot<E>>) {
        self.in_flight -= 1;
        let env_index = slot.env_index;
        self.idle[env_index] = Some(slot);
    }

    pub(super) fn check_all_idle(&self) -> Result<(), VecEnvError> {
        // A lost environment stays in flight for ever.
        self.pool.check()?;
        match self.in_flight {
            0 => Ok(()),
            count => Err(VecEnvError::InFlight { count }),
        }
    }

    fn check_actions(&self, actions: &[ActionElement<E>], rows: usize) -> Result<(), VecEnvError> {
        let (action_len, actual) = (self.action_space.action_len(), actions.len());
        if rows.checked_mul(action_len) == Some(actual) {
            Ok(())
        } else {
            Err(VecEnvError::ActionCount { rows, action_len, actual })
        }
    }
}

impl<E: Env<Observation: BatchObservation>> fmt::Debug for VecEnv<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("VecEnv")
            .field("num_envs", &self.idle.len())
            .field("in_flight", &self.in_flight)
            .field("autoreset", &self.autoreset)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests;
