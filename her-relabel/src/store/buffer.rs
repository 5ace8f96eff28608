//! The buffer: adding episodes, and what is kept of them.

use crate::add::arguments::{AddError, EpisodeData, EpisodeStart, Step};
use crate::add::recorder::Recorder;
use crate::store::episodes::Ending;
use crate::store::storage::{Storage, TransitionId};
use crate::{BufferConfig, ConfigError, Scalar};

/// A replay buffer for goal-conditioned tasks that keeps the newest `capacity` transitions of
/// finished episodes.
///
/// An episode enters the buffer when it ends, all its transitions at once; until then its steps are
/// set aside, environment by environment, and are never sampled. So *newest* is in the order in which
/// episodes ended, and within an episode in the order of its steps. Each state is stored once:
/// an episode of `T` steps takes `T + 1` rows.
///
/// [`Sampler`](crate::Sampler) draws batches from a shared reference, and nothing is changed
/// through one. So for one writer and concurrent readers the buffer goes into an
/// [`RwLock`](std::sync::RwLock): readers sample side by side, and no reader ever sees half of a step.
/// ```
/// use std::{sync::RwLock, thread};
///
/// use goal_reward::DistanceReward;
/// use her_relabel::{Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer};
/// use her_relabel::{RelabelRatio, Sampler};
///
/// let episode = EpisodeData {
///     observations: &[0.0, 1.0],
///     achieved_goals: &[0.0, 1.0],
///     desired_goal: &[9.0],
///     actions: &[1.0],
///     rewards: &[-1.0],
///     terminated: false,
///     truncated: true,
///     fields: &[],
/// };
/// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
/// let mut buffer = HerBuffer::<f32>::new(config)?;
/// buffer.add_episode(&episode)?;
/// let shared = RwLock::new(buffer);
/// thread::scope(|scope| {
///     for reader in 0..2 {
///         let shared = &shared;
///         scope.spawn(move || {
///             let sampler = Sampler::new(64, GoalStrategy::Future, RelabelRatio::from_k(4));
///             let mut batch = Batch::new();
///             let buffer = shared.read().expect("no writer panicked");
///             sampler.sample_seeded(&buffer, &DistanceReward::sparse(), reader, &mut batch)
///         });
///     }
///     // The batch is the reader's own: only sampling needs the lock, not learning.
///     shared.write().expect("no writer panicked").add_episode(&episode)
/// })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Example
/// ```
/// use her_relabel::{BufferConfig, Dims, EpisodeStart, HerBuffer, Step};
///
/// let config = BufferConfig::new(1000, Dims { observation: 2, goal: 1, action: 1 });
/// let mut buffer = HerBuffer::<f32>::new(config)?;
/// buffer.begin_episode(0, &EpisodeStart {
///     observation: &[0.0, 0.0],
///     achieved_goal: &[0.0],
///     desired_goal: &[2.0],
/// })?;
/// buffer.add_step(0, &Step {
///     action: &[1.0],
///     reward: -1.0,
///     next_observation: &[1.0, 1.0],
///     next_achieved_goal: &[1.0],
///     terminated: false,
///     truncated: true,
///     fields: &[],
/// })?;
/// assert_eq!((buffer.len(), buffer.n_episodes()), (1, 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct HerBuffer<T> {
    pub(crate) config: BufferConfig,
    pub(crate) storage: Storage<T>,
    pub(crate) recorders: Vec<Recorder<T>>,
    /// Where whole episodes are put into rows.
    pub(crate) whole: Recorder<T>,
}

impl<T: Scalar> HerBuffer<T> {
    /// An empty buffer. Memory is taken as transitions come.
    ///
    /// # Errors
    /// [`ConfigError`] if a size is 0 or beyond what can be addressed.
    pub fn new(config: BufferConfig) -> Result<Self, ConfigError> {
        Ok(Self {
            storage: Storage::new(&config)?,
            recorders: vec![Recorder::default(); config.n_envs],
            whole: Recorder::default(),
            config,
        })
    }

    /// The sizes the buffer was made with.
    #[must_use]
    pub fn config(&self) -> &BufferConfig {
        &self.config
    }

    /// The number of transitions that can be sampled, at most the capacity.
    #[must_use]
    pub fn len(&self) -> usize {
        let live = self.storage.episodes.live();
        (live.end - live.start) as usize
    }

    /// Whether nothing can be sampled.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.storage.episodes.live().is_empty()
    }

    /// The number of finished episodes of which at least one transition is kept.
    #[must_use]
    pub fn n_episodes(&self) -> usize {
        self.storage.episodes.len()
    }

    /// The oldest and the newest transition that can be sampled; all numbers between can be as well.
    #[must_use]
    pub fn transition_ids(&self) -> Option<(TransitionId, TransitionId)> {
        let live = self.storage.episodes.live();
        let ids = (TransitionId::of(live.start), TransitionId::of(live.end.saturating_sub(1)));
        (!live.is_empty()).then_some(ids)
    }

    /// The number of steps of environment `env`'s unfinished episode; `None` if none is under way.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`].
    pub fn unfinished_steps(&self, env: usize) -> Result<Option<usize>, AddError> {
        let recorder = self.recorders.get(env).ok_or(self.unknown(env))?;
        let steps = recorder.steps(&self.storage.layout).min(self.config.capacity);
        Ok(recorder.is_recording().then_some(steps))
    }

    /// Begins an episode of environment `env`, after its reset.
    ///
    /// # Errors
    /// [`AddError::EpisodeUnderWay`], or what is wrong with the state.
    pub fn begin_episode<S: Scalar>(
        &mut self,
        env: usize,
        start: &EpisodeStart<'_, S>,
    ) -> Result<(), AddError> {
        let unknown = self.unknown(env);
        let recorder = self.recorders.get_mut(env).ok_or(unknown)?;
        if recorder.is_recording() {
            return Err(AddError::EpisodeUnderWay { env });
        }
        start.check::<T>(&self.storage.layout)?;
        recorder.begin(&self.storage.layout, start);
        Ok(())
    }

    /// Adds a step of environment `env`. A terminated or truncated step ends the episode, whose
    /// transitions can be sampled from then on.
    ///
    /// # Errors
    /// [`AddError::NoEpisode`], or what is wrong with the step.
    pub fn add_step<S: Scalar>(&mut self, env: usize, step: &Step<'_, S>) -> Result<(), AddError> {
        self.check_recording(env)?;
        step.check::<T>(&self.storage.layout, &self.storage.fields)?;
        self.record(env, step, 0);
        Ok(())
    }

    /// Ends the episode of environment `env` where it is, as truncated. Without a step nothing is
    /// stored.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`] or [`AddError::NoEpisode`].
    pub fn end_episode(&mut self, env: usize) -> Result<(), AddError> {
        self.check_recording(env)?;
        if self.recorders[env].steps(&self.storage.layout) == 0 {
            self.recorders[env].discard();
        } else {
            self.store(env, Ending { terminated: false, truncated: true });
        }
        Ok(())
    }

    /// Forgets the unfinished episode of environment `env`.
    ///
    /// # Errors
    /// [`AddError::UnknownEnv`] or [`AddError::NoEpisode`].
    pub fn discard_episode(&mut self, env: usize) -> Result<(), AddError> {
        self.check_recording(env)?;
        self.recorders[env].discard();
        Ok(())
    }

    /// Adds a whole episode, whatever the environments are doing. Of an episode longer than the
    /// capacity the newest transitions are kept.
    ///
    /// # Errors
    /// What is wrong with the episode.
    pub fn add_episode<S: Scalar>(&mut self, episode: &EpisodeData<'_, S>) -> Result<(), AddError> {
        let Storage { layout, capacity, ref fields, .. } = self.storage;
        episode.check::<T>(&layout, fields)?;
        self.whole.record(&layout, fields, capacity, episode);
        let EpisodeData { terminated, truncated, .. } = *episode;
        let rows = self.whole.finish(&layout, capacity);
        self.storage.push_episode(rows, Ending { terminated, truncated });
        Ok(())
    }

    /// Forgets everything, unfinished episodes too. The memory is kept for what comes.
    pub fn clear(&mut self) {
        self.storage.clear();
        self.recorders.iter_mut().for_each(Recorder::discard);
    }

    fn unknown(&self, env: usize) -> AddError {
        AddError::UnknownEnv { env, n_envs: self.config.n_envs }
    }

    pub(crate) fn check_recording(&self, env: usize) -> Result<(), AddError> {
        let recorder = self.recorders.get(env).ok_or(self.unknown(env))?;
        if recorder.is_recording() { Ok(()) } else { Err(AddError::NoEpisode { env }) }
    }

    /// Adds a checked step to the episode under way, with row `at` of the fields that are given.
    pub(crate) fn record<S: Scalar>(&mut self, env: usize, step: &Step<'_, S>, at: usize) {
        let Storage { layout, capacity, ref fields, .. } = self.storage;
        self.recorders[env].step(&layout, fields, capacity, step, at);
        let Step { terminated, truncated, .. } = *step;
        if terminated || truncated {
            self.store(env, Ending { terminated, truncated });
        }
    }

    /// Stores the episode of environment `env`, which has a step at least.
    fn store(&mut self, env: usize, ending: Ending) {
        let Storage { layout, capacity, .. } = self.storage;
        let recorder = &mut self.recorders[env];
        self.storage.push_episode(recorder.finish(&layout, capacity), ending);
        recorder.discard();
    }
}
