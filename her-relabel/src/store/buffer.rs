//! The buffer: its configuration, contents and priorities.

use crate::scalar::Scalar;
use crate::store::config::{BufferConfig, ConfigError};
use crate::store::priorities::{PriorityError, is_priority};
use crate::store::storage::{Storage, Unfinished};
use crate::store::transition_id::TransitionId;

/// A replay buffer for goal-conditioned tasks that keeps the newest `capacity` transitions of
/// finished episodes.
///
/// An episode enters the buffer as a whole when it ends; until then its steps are kept apart and
/// are never sampled. *Newest* therefore means the order in which episodes ended, and within an
/// episode the order of its steps. Each state is stored once: an episode of `T` steps takes `T + 1`
/// rows.
///
/// [`Sampler`](crate::Sampler) draws batches from a shared reference. For one writer and several
/// readers, put the buffer into an [`RwLock`](std::sync::RwLock). The
/// [crate's example](crate#example) adds an episode step by step.
///
/// # Example
/// ```
/// use std::{sync::RwLock, thread};
///
/// use goal_reward::DistanceReward;
/// use her_relabel::{Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer};
/// use her_relabel::{Sampler, UnitInterval};
/// use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
///
/// let episode = EpisodeData {
///     observation: &[0.0, 1.0],
///     achieved_goal: &[0.0, 1.0],
///     desired_goal: &[9.0],
///     action: &[1.0],
///     reward: &[-1.0],
///     terminated: false,
///     truncated: true,
///     fields: &[],
/// };
/// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
/// let mut buffer = HerBuffer::<f32>::new(config)?;
/// buffer.add_episode(&episode)?;
/// let shared = RwLock::new(buffer);
/// thread::scope(|scope| {
///     for reader in 0..2_u64 {
///         let shared = &shared;
///         scope.spawn(move || {
///             let sampler = Sampler::new(64, GoalStrategy::Future, UnitInterval::from_k(4));
///             let mut batch = Batch::<f32>::new();
///             let mut random = ChaCha8Rng::seed_from_u64(reader);
///             let buffer = shared.read().expect("no writer panicked");
///             sampler.sample(&buffer, &DistanceReward::sparse(), &mut random, &mut batch)
///         });
///     }
///     // Each reader owns its batch: only sampling needs the lock, learning does not.
///     shared.write().expect("no writer panicked").add_episode(&episode)
/// })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct HerBuffer<T> {
    pub(crate) config: BufferConfig,
    pub(crate) storage: Storage<T>,
    /// The unfinished episode of each environment.
    pub(crate) unfinished: Vec<Unfinished<T>>,
    /// Scratch memory: whether each environment has a row in a call.
    pub(crate) has_row: Vec<bool>,
    /// Scratch memory in which whole episodes become rows.
    pub(crate) whole: Unfinished<T>,
}

impl<T: Scalar> HerBuffer<T> {
    /// Creates an empty buffer, which allocates memory only as transitions are added.
    ///
    /// # Errors
    /// [`ConfigError`] if a setting is invalid.
    pub fn new(config: BufferConfig) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self {
            storage: Storage::new(&config)?,
            unfinished: one_each(&config, Unfinished::default())?,
            has_row: one_each(&config, false)?,
            whole: Unfinished::default(),
            config,
        })
    }

    /// Returns the buffer's settings.
    pub fn config(&self) -> &BufferConfig {
        &self.config
    }

    /// Returns the number of transitions that can be sampled, at most the capacity.
    #[must_use]
    pub fn len(&self) -> usize {
        let live = self.storage.episodes.live();
        (live.end - live.start) as usize
    }

    /// Returns whether there is nothing to sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.storage.episodes.live().is_empty()
    }

    /// Returns the number of finished episodes of which at least one transition is kept.
    #[must_use]
    pub fn num_episodes(&self) -> usize {
        self.storage.episodes.len()
    }

    /// Returns the oldest and the newest transition that can be sampled; all between them can be,
    /// too.
    #[must_use]
    pub fn transition_ids(&self) -> Option<(TransitionId, TransitionId)> {
        let live = self.storage.episodes.live();
        let ids = (TransitionId::of(live.start), TransitionId::of(live.end.saturating_sub(1)));
        (!live.is_empty()).then_some(ids)
    }

    /// Forgets everything, including unfinished episodes. The memory is kept for later transitions.
    pub fn clear(&mut self) {
        self.storage.clear();
        let under_way = self.unfinished.iter_mut().filter(|episode| episode.is_under_way());
        under_way.for_each(Unfinished::discard);
    }

    /// Sets the priorities of transitions, or of their episodes. If a transition is given several
    /// times, the last priority counts. Overwritten transitions are ignored.
    ///
    /// A priority is itself the weight of a draw: for the paper's prioritized replay, pass
    /// `(|td_error| + epsilon).powf(alpha)`.
    ///
    /// # Errors
    /// [`PriorityError`].
    pub fn set_priorities<S: Scalar>(
        &mut self,
        transitions: &[TransitionId],
        priorities: &[S],
    ) -> Result<(), PriorityError> {
        let episodes = &self.storage.episodes;
        let table = self.storage.priorities.as_mut().ok_or(PriorityError::NoPriorities)?;
        let lens = (transitions.len(), priorities.len());
        if lens.0 != lens.1 {
            return Err(PriorityError::WrongLength { transitions: lens.0, priorities: lens.1 });
        }
        let is_bad = |priority: &S| !is_priority(priority.to_f64());
        if let Some(index) = priorities.iter().position(is_bad) {
            let priority = priorities[index].to_f64();
            return Err(PriorityError::BadPriority { index, priority });
        }
        let live = episodes.live();
        if let Some(id) = transitions.iter().find(|id| id.number() >= live.end) {
            return Err(PriorityError::UnknownTransition { number: id.get() });
        }
        let pairs = transitions.iter().zip(priorities);
        for (id, priority) in pairs.filter(|(id, _)| id.number() >= live.start) {
            table.set(episodes, id.number(), priority.to_f64());
        }
        Ok(())
    }

    /// Returns the priority of a transition, or of its episode; `None` if it has been overwritten
    /// or the buffer has no priorities.
    #[must_use]
    pub fn priority(&self, transition: TransitionId) -> Option<f64> {
        let (episodes, number) = (&self.storage.episodes, transition.number());
        let table = self.storage.priorities.as_ref()?;
        episodes.live().contains(&number).then(|| table.priority(episodes, number))
    }
}

/// Creates an element for each environment.
fn one_each<E: Clone>(config: &BufferConfig, element: E) -> Result<Vec<E>, ConfigError> {
    let mut elements = Vec::new();
    elements.try_reserve_exact(config.num_envs()).map_err(|_| ConfigError::TooLarge)?;
    elements.resize(config.num_envs(), element);
    Ok(elements)
}
