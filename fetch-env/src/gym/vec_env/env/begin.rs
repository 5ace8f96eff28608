//! Starting the work of environments: on the threads, or immediately on the caller's.

use super::VecEnv;
use crate::gym::env::observation::BatchObservation;
use crate::gym::env::{ActionElement, Env, action_space::ActionSpace};
use crate::gym::vec_env::{
    config::VecReset,
    error::VecEnvError,
    pool::{Job, Place},
    slot::{Command, Slot},
};

impl<E: Env<Observation: BatchObservation> + Send + 'static> VecEnv<E> {
    pub(super) fn begin_seeded(
        &mut self,
        seed: Option<u64>,
        place: Place,
    ) -> Result<(), VecEnvError> {
        let num_envs = self.num_envs();
        if let Some(first) = seed
            && first.checked_add(num_envs as u64 - 1).is_none()
        {
            return Err(VecEnvError::SeedTooLarge { first, num_envs });
        }
        let seed_of = |env_index| seed.map(|first| first + env_index as u64);
        self.begin_resets(None, place, |env_index| (seed_of(env_index), E::ResetOptions::default()))
    }

    pub(super) fn begin_chosen(
        &mut self,
        reset: &VecReset<'_, E::ResetOptions>,
        place: Place,
    ) -> Result<(), VecEnvError> {
        reset.check(self.num_envs())?;
        self.begin_resets(reset.mask, place, |env_index| {
            let seed = reset.seeds.and_then(|seeds| seeds[env_index]);
            (seed, reset.options.map_or_else(Default::default, |each| each[env_index].clone()))
        })
    }

    fn begin_resets(
        &mut self,
        mask: Option<&[bool]>,
        place: Place,
        start: impl Fn(usize) -> (Option<u64>, E::ResetOptions),
    ) -> Result<(), VecEnvError> {
        self.pool.check()?;
        let is_chosen = |env_index: &usize| mask.is_none_or(|mask| mask[*env_index]);
        let chosen = (0..self.num_envs()).filter(is_chosen);
        if let Some(env_index) = chosen.clone().find(|&env_index| self.idle[env_index].is_none()) {
            return Err(VecEnvError::EnvInFlight { env_index });
        }
        for env_index in chosen {
            let (seed, options) = start(env_index);
            self.begin(env_index, place, |slot| {
                slot.was_reset = true;
                slot.command = Command::Reset { seed, options };
            });
        }
        self.wake(place);
        Ok(())
    }

    pub(super) fn begin_step(
        &mut self,
        row: usize,
        actions: &[ActionElement<E>],
        env_index: usize,
        place: Place,
    ) {
        let len = self.action_space.action_len();
        self.begin(env_index, place, |slot| {
            slot.command = Command::Step;
            slot.action.copy_from_slice(&actions[row * len..][..len]);
        });
    }

    /// Gives an environment a command, which it carries out immediately, or on a thread after
    /// [`wake`](Self::wake).
    fn begin(&mut self, env_index: usize, place: Place, command: impl FnOnce(&mut Slot<E>)) {
        let threads = self.num_threads();
        // Neighboring environments share a thread, whose queue has room for all of them.
        let home = env_index * threads / self.num_envs();
        if let Some(mut slot) = self.idle[env_index].take() {
            command(&mut slot);
            if place == Place::Caller {
                slot.run();
                self.idle[env_index] = Some(slot);
                return;
            }
            self.in_flight += 1;
            self.pool.lend(home, slot);
        }
    }

    pub(super) fn wake(&self, place: Place) {
        if place == Place::Threads {
            self.pool.wake();
        }
    }

    /// Returns where calls that wait for all environments run them. With a single thread the caller
    /// would only wait for it.
    pub(super) fn place(&self) -> Place {
        if self.num_threads() == 1 { Place::Caller } else { Place::Threads }
    }
}
