//! Collects steps of many environments into a hindsight replay buffer.

use fetch_env::vec_env::{AutoresetMode, VecEnvError, VecReset};
use fetch_env::{
    ActionElement, ActionSpace, EnvError, GoalEnv, GoalObservation, SnapshotEnv, VecEnv,
    WrappedSnapshot,
};
use her_relabel::{AddError, HerBuffer, RefusedRow, Scalar};
use serde::{Deserialize, Serialize};

use crate::across_workers::{Message, from_message, to_message};
use crate::evaluate::{Episode, MAX_COUNT, check_vec_policy};
use crate::policy::{PolicyError, VecPolicy};

/// A goal-conditioned environment that a [`VecEnv`] can step and whose numbers a hindsight replay
/// buffer can store: its observations and actions are `f32` or `f64`.
///
/// Every such environment implements this trait. A function that takes any of them:
///
/// ```
/// use baselines::{CollectEnv, Collector, CollectorError, VecPolicy};
/// use fetch_env::ActionElement;
/// use her_relabel::HerBuffer;
///
/// /// Collects steps until the buffer has `len`.
/// fn fill<E: CollectEnv>(
///     collector: &mut Collector<E>,
///     policy: &mut impl VecPolicy<E::Observation, E::Info, ActionElement<E>>,
///     buffer: &mut HerBuffer<f32>,
///     len: usize,
/// ) -> Result<(), CollectorError> {
///     while buffer.len() < len {
///         collector.collect(50, policy, buffer, |_, _| ())?;
///     }
///     Ok(())
/// }
/// ```
pub trait CollectEnv:
    GoalEnv<
        Observation: GoalObservation<Element: Scalar>,
        ActionSpace: ActionSpace<Element: Scalar>,
    > + Send
    + 'static
{
}

impl<E> CollectEnv for E where
    E: GoalEnv<
            Observation: GoalObservation<Element: Scalar>,
            ActionSpace: ActionSpace<Element: Scalar>,
        > + Send
        + 'static
{
}

/// Environments that a policy steps, and whose steps a hindsight replay buffer records.
///
/// ```
/// use baselines::{Collector, RandomPolicy, buffer_config};
/// use fetch_env::{Env, VecEnv, make_kinematic, vec_env::VecConfig};
/// use her_relabel::HerBuffer;
///
/// let envs = (0..8).map(|_| make_kinematic("FetchPush-v4")).collect::<Result<Vec<_>, _>>()?;
/// let config = buffer_config(100_000, &envs[0])?.with_num_envs(envs.len());
/// let mut policy = RandomPolicy::new(envs[0].action_space(), 0);
/// let mut buffer = HerBuffer::<f32>::new(config)?;
/// let mut collector = Collector::new(VecEnv::new(envs, VecConfig::default())?);
/// let mut successes = 0;
/// collector.collect(101, &mut policy, &mut buffer, |_, episode| {
///     successes += usize::from(episode.success);
/// })?;
/// // The autoreset between two episodes takes one of the 101 steps.
/// assert_eq!(buffer.len(), 8 * 100);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Collector<E: CollectEnv> {
    envs: VecEnv<E>,
    /// The actions of all environments, a row for each.
    actions: Vec<ActionElement<E>>,
    /// The unfinished episode of each environment.
    episodes: Vec<Episode>,
    has_started: bool,
}

/// Snapshot of a [`Collector`]: its environments and their unfinished episodes. `S` is an
/// environment's own snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CollectorSnapshot<S> {
    envs: Vec<WrappedSnapshot<S, u64>>,
    /// `None` for episodes without steps.
    episodes: Vec<Option<Message>>,
}

/// The result of a call of [`Collector::collect`].
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Collected {
    /// The number of steps added to the buffer.
    pub recorded_steps: usize,
    /// The number of episodes that ended, including motionless ones that the buffer left out.
    pub finished_episodes: usize,
    /// The number of episodes discarded because their environment failed.
    pub discarded_episodes: usize,
    /// The first environment that failed, and its error.
    pub first_failure: Option<(usize, EnvError)>,
    /// The first environment that took no step because it could not be reset, and its last error.
    pub first_stuck: Option<(usize, EnvError)>,
}

/// Error returned by a [`Collector`].
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum CollectorError {
    /// The policy does not fit these environments.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// The environments could not be stepped together.
    #[error(transparent)]
    Vec(#[from] VecEnvError),
    /// An environment could not be reset.
    #[error("environment {env_index} could not be reset")]
    Environment {
        /// The environment, counted from 0.
        env_index: usize,
        /// The environment's error.
        source: EnvError,
    },
    /// The buffer does not fit these environments.
    #[error(
        "the buffer does not fit the environments: make it with buffer_config() of one of them, \
         and pass it to reset(), or resume it after a restore(), before collecting into it"
    )]
    Buffer(#[from] AddError),
    /// An environment returned numbers that the buffer cannot store.
    #[error("environment {env_index} returned a number that the buffer cannot store")]
    NotFinite {
        /// The environment, counted from 0.
        env_index: usize,
        /// The number, and where it is.
        source: AddError,
    },
}

debug_as_display!(CollectorError);

impl From<RefusedRow> for CollectorError {
    fn from(RefusedRow { env_index, error, .. }: RefusedRow) -> Self {
        Self::NotFinite { env_index, source: error }
    }
}

impl<E: CollectEnv> Collector<E> {
    /// Creates a collector of environments, which the first call of [`collect`](Self::collect)
    /// resets.
    #[must_use]
    pub fn new(envs: VecEnv<E>) -> Self {
        let num_envs = envs.num_envs();
        let len = num_envs * envs.single_action_space().action_len();
        Self {
            envs,
            actions: vec![ActionElement::<E>::default(); len],
            episodes: vec![Episode::new(None); num_envs],
            has_started: false,
        }
    }

    /// Returns the environments.
    #[must_use]
    pub const fn envs(&self) -> &VecEnv<E> {
        &self.envs
    }

    /// Resets all environments, the first with `seed`, the next with `seed + 1`, and so on. Without
    /// a seed their random numbers continue.
    ///
    /// Before collecting into a different buffer, reset with that buffer.
    ///
    /// # Errors
    /// [`CollectorError`], as from [`collect`](Self::collect).
    pub fn reset<T: Scalar>(
        &mut self,
        seed: Option<u64>,
        buffer: &mut HerBuffer<T>,
    ) -> Result<(), CollectorError> {
        let batch = self.envs.reset(seed)?;
        let recorded = buffer.record(batch)?;
        if let Some((env_index, error)) = batch.errors().next() {
            return Err(CollectorError::Environment { env_index, source: error.clone() });
        }
        recorded.check()?;
        for (env_index, episode) in (0..).zip(&mut self.episodes) {
            *episode = Episode::new(seed.map(|seed| seed.wrapping_add(env_index)));
        }
        self.has_started = true;
        Ok(())
    }

    /// Returns the state of the environments and of their unfinished episodes.
    ///
    /// # Errors
    /// As [`VecEnv::snapshot`].
    pub fn snapshot(&self) -> Result<CollectorSnapshot<E::Snapshot>, VecEnvError>
    where
        E: SnapshotEnv,
    {
        let episodes = self.episodes.iter();
        Ok(CollectorSnapshot {
            envs: self.envs.snapshot()?,
            episodes: episodes
                .map(|episode| (episode.episode_length > 0).then(|| to_message(episode)))
                .collect(),
        })
    }

    /// Restores a snapshot: collecting continues where it was taken. The first batch that the
    /// policy then sees has the restored observations, as [`VecEnv::restore`] shows them.
    ///
    /// A buffer goes on only after it was told of these states, with which its unfinished episodes
    /// go on or end:
    /// `buffer.resume(collector.envs().last_step())` (see [`HerBuffer::resume`]).
    ///
    /// # Errors
    /// As [`VecEnv::restore`]; nothing has changed then.
    pub fn restore(&mut self, snapshot: &CollectorSnapshot<E::Snapshot>) -> Result<(), VecEnvError>
    where
        E: SnapshotEnv,
    {
        let (actual, num_envs) = (snapshot.episodes.len(), self.envs.num_envs());
        if actual != num_envs {
            return Err(VecEnvError::Count { what: "snapshot", actual, num_envs });
        }
        let episodes = snapshot.episodes.iter();
        let episodes: Vec<_> =
            episodes.map(|episode| episode.map_or(Episode::new(None), from_message)).collect();
        let lengths = episodes.iter().map(|episode| episode.episode_length);
        if let Some((env_index, length)) =
            lengths.enumerate().find(|(_, len)| *len as u64 > MAX_COUNT)
        {
            let reason = format!("its episode has {length} steps");
            return Err(VecEnvError::ForeignSnapshot { env_index, reason });
        }
        self.envs.restore(&snapshot.envs)?;
        self.episodes = episodes;
        self.has_started = true;
        Ok(())
    }

    /// Takes `num_steps` steps in each environment, from where the last call ended, and records
    /// them. Calls `progress` with the environment and the result of each episode that ends.
    ///
    /// `policy` sees the last batch and chooses the actions of all environments, a row for each. An
    /// environment that fails loses its episode and begins the next one.
    ///
    /// # Errors
    /// [`CollectorError::Policy`] if the policy does not fit the environments,
    /// [`CollectorError::Vec`] if they are in flight, [`CollectorError::Buffer`] if the buffer does
    /// not fit them, [`CollectorError::NotFinite`] if it cannot store an environment's numbers.
    pub fn collect<T: Scalar>(
        &mut self,
        num_steps: usize,
        policy: &mut (impl VecPolicy<E::Observation, E::Info, ActionElement<E>> + ?Sized),
        buffer: &mut HerBuffer<T>,
        mut progress: impl FnMut(usize, &Episode),
    ) -> Result<Collected, CollectorError> {
        check_vec_policy(&self.envs, policy)?;
        if !self.has_started {
            self.reset(None, buffer)?;
        }
        let mut collected = Collected::default();
        // Environments that have taken no step and begun no episode.
        let mut still = vec![num_steps > 0; self.envs.num_envs()];
        for _ in 0..num_steps {
            policy.act_all(self.envs.last_step(), &mut self.actions);
            let batch = self.envs.step(&self.actions)?;
            let recorded = buffer.record(batch)?;
            collected.recorded_steps += recorded.recorded_steps;
            collected.finished_episodes += recorded.finished_episodes;
            collected.discarded_episodes += recorded.discarded_episodes;
            // Other environments' rows are in the buffer even if one was refused.
            let checked = recorded.check();
            if collected.first_failure.is_none() {
                let failure = batch.errors().next();
                collected.first_failure =
                    failure.map(|(env_index, error)| (env_index, error.clone()));
            }
            for (env_index, episode) in self.episodes.iter_mut().enumerate() {
                let is_last = batch.terminated()[env_index] || batch.truncated()[env_index];
                still[env_index] &= !(batch.stepped()[env_index] || batch.started()[env_index]);
                if let (true, Some(info)) = (batch.stepped()[env_index], batch.step_info(env_index))
                {
                    episode.add(batch.reward()[env_index], info.as_ref());
                    if is_last {
                        progress(env_index, episode);
                    }
                }
                if is_last {
                    *episode = Episode::new(None);
                }
            }
            if self.envs.autoreset_mode() == AutoresetMode::Disabled {
                self.reset_ended(buffer)?;
            }
            checked?;
        }
        let mut errors = self.envs.last_step().errors().filter(|(env_index, _)| still[*env_index]);
        collected.first_stuck = errors.next().map(|(env_index, error)| (env_index, error.clone()));
        Ok(collected)
    }

    /// Resets the environments whose episodes have ended.
    fn reset_ended<T: Scalar>(&mut self, buffer: &mut HerBuffer<T>) -> Result<(), CollectorError> {
        let batch = self.envs.last_step();
        let ends = batch.terminated().iter().zip(batch.truncated());
        let mask: Vec<bool> =
            ends.map(|(terminated, truncated)| *terminated || *truncated).collect();
        if mask.contains(&true) {
            let reset = VecReset { mask: Some(&mask), ..VecReset::default() };
            buffer.record(self.envs.reset_with(&reset)?)?.check()?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_snapshot_survives_json_whatever_its_numbers() {
        let numbers = [f64::NAN, f64::INFINITY, -0.0];
        let episodes = numbers.map(|number| {
            let episode =
                Episode { episode_return: number, final_distance: number, ..Episode::new(Some(1)) };
            Some(to_message(&episode))
        });
        let snapshot = CollectorSnapshot::<()> { envs: Vec::new(), episodes: episodes.into() };
        let json = serde_json::to_string(&snapshot).unwrap();
        assert_eq!(serde_json::from_str::<CollectorSnapshot<()>>(&json).unwrap(), snapshot);
    }
}
