//! Drawing batches: which transitions, which goals, what rewards.

use std::num::NonZeroUsize;

use goal_reward::GoalReward;
use rand_core::Rng;
use serde::{Deserialize, Serialize};

use crate::sample::columns::Rows;
use crate::sample::draws::Draws;
use crate::sample::gather::{Counts, gather};
use crate::sample::outcome;
use crate::sample::parallel::gather_parallel;
use crate::store::config::Dims;
use crate::store::priority_table::PriorityTable;
use crate::store::storage::Storage;
use crate::{
    Batch, Beta, Discount, GoalMixture, GoalStrategy, HerBuffer, RelabelRatio, SampleError, Scalar,
};

/// Windows of several steps, for n-step returns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NStep {
    /// The most steps of a window. It is shorter where the episode ends.
    pub steps: NonZeroUsize,
    /// The discount of each further reward.
    pub gamma: Discount,
}

/// How batches are drawn. A small value: to change something for one call, use another, such as
/// `sampler.with_ratio(RelabelRatio::NONE)`.
///
/// Every row is drawn on its own: a live transition, uniformly (or by its priority) and with replacement;
/// then, with the
/// probability of the ratio, a new goal by the strategy. A relabeled row gets the new goal and
/// the reward `f(next_achieved_goal, new_goal)`; everything else in it, and all of the other rows, is
/// as it was stored, unless the sampler is told otherwise.
///
/// The time of a draw is proportional to the batch and does not depend on how much is stored.
///
/// # Example
/// ```
/// use goal_reward::DistanceReward;
/// use her_relabel::{Batch, BufferConfig, Dims, EpisodeData, HerBuffer};
/// use her_relabel::{GoalStrategy, RelabelRatio, Sampler};
///
/// let mut buffer = HerBuffer::<f64>::new(BufferConfig::new(
///     1000,
///     Dims { observation: 1, goal: 1, action: 1 },
/// ))?;
/// buffer.add_episode(&EpisodeData {
///     observations: &[0.0, 1.0, 2.0],
///     achieved_goals: &[0.0, 1.0, 2.0],
///     desired_goal: &[9.0],
///     actions: &[1.0, 1.0],
///     rewards: &[-1.0, -1.0],
///     terminated: false,
///     truncated: true,
///     fields: &[],
/// })?;
/// let sampler = Sampler::new(256, GoalStrategy::Final, RelabelRatio::ALL);
/// let mut batch = Batch::new();
/// sampler.sample_seeded(&buffer, &DistanceReward::sparse(), 1, &mut batch)?;
/// assert!(batch.desired_goal().iter().all(|goal| *goal == 2.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Sampler {
    /// The number of rows of a batch; at least 1.
    pub batch_size: usize,
    /// Where new goals come from.
    pub goals: GoalMixture,
    /// The share of rows that get one.
    pub ratio: RelabelRatio,
    /// Whether the relabeled rows are terminated as the reward function says of their new goal, in
    /// place of what was stored. Off in a new sampler, as in the paper.
    pub recompute_terminated: bool,
    /// Whether [`Batch::success`] is computed. Off in a new sampler.
    pub success: bool,
    /// Rows of several steps instead of one. `None` in a new sampler.
    pub n_step: Option<NStep>,
    /// Draws by the buffer's priorities, with [`Batch::importance_weight`]s, in place of uniform ones.
    /// `None` in a new sampler.
    pub prioritized: Option<Beta>,
}

impl Sampler {
    /// Batches of `batch_size` rows.
    #[must_use]
    pub const fn new(batch_size: usize, strategy: GoalStrategy, ratio: RelabelRatio) -> Self {
        Self {
            batch_size,
            goals: GoalMixture::only(strategy),
            ratio,
            recompute_terminated: false,
            success: false,
            n_step: None,
            prioritized: None,
        }
    }

    /// The same with batches of `batch_size` rows.
    #[must_use]
    pub const fn with_batch_size(mut self, batch_size: usize) -> Self {
        self.batch_size = batch_size;
        self
    }

    /// The same with new goals by `strategy`.
    #[must_use]
    pub const fn with_strategy(self, strategy: GoalStrategy) -> Self {
        self.with_goals(GoalMixture::only(strategy))
    }

    /// The same with new goals by several strategies.
    #[must_use]
    pub const fn with_goals(mut self, goals: GoalMixture) -> Self {
        self.goals = goals;
        self
    }

    /// The same with the share `ratio` of new goals.
    #[must_use]
    pub const fn with_ratio(mut self, ratio: RelabelRatio) -> Self {
        self.ratio = ratio;
        self
    }

    /// The same with the termination of relabeled rows computed for their new goal, or as it was
    /// stored.
    #[must_use]
    pub const fn with_recomputed_terminated(mut self, recompute: bool) -> Self {
        self.recompute_terminated = recompute;
        self
    }

    /// The same with [`Batch::success`], or without.
    #[must_use]
    pub const fn with_success(mut self, success: bool) -> Self {
        self.success = success;
        self
    }

    /// The same with rows of up to `n_step.steps` steps.
    ///
    /// A row's window begins with its transition and ends with the episode at the latest. It has one
    /// goal, for which all of its rewards are computed if the row is relabeled; a goal of the future
    /// is one of the states after the first step. [`Batch::reward`] is the discounted sum of the
    /// rewards, the next observation and the flags belong to the last step, and [`Batch::discount`] is
    /// what to multiply the next value with. If termination is recomputed, a window ends with the first
    /// step that terminates.
    #[must_use]
    pub const fn with_n_step(mut self, n_step: NStep) -> Self {
        self.n_step = Some(n_step);
        self
    }

    /// The same with draws by the buffer's [`Priorities`](crate::Priorities), and importance weights.
    /// Each draw takes the logarithm of how much is stored.
    ///
    /// # Example
    /// ```
    /// use goal_reward::DistanceReward;
    /// use her_relabel::{Batch, Beta, BufferConfig, Dims, EpisodeData, HerBuffer};
    /// use her_relabel::{GoalStrategy, NewPriority, PriorityUnit, RelabelRatio, Sampler};
    ///
    /// let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 })
    ///     .with_priorities(PriorityUnit::Transition, NewPriority::Highest);
    /// let mut buffer = HerBuffer::<f32>::new(config)?;
    /// buffer.add_episode(&EpisodeData {
    ///     observations: &[0.0, 1.0, 2.0],
    ///     achieved_goals: &[0.0, 1.0, 2.0],
    ///     desired_goal: &[9.0],
    ///     actions: &[1.0, 1.0],
    ///     rewards: &[-1.0, -1.0],
    ///     terminated: false,
    ///     truncated: true,
    ///     fields: &[],
    /// })?;
    /// let mut batch = Batch::new();
    /// let sampler = Sampler::new(32, GoalStrategy::Future, RelabelRatio::from_k(4))
    ///     .with_priorities(Beta::new(0.4)?);
    /// sampler.sample_seeded(&buffer, &DistanceReward::sparse(), 1, &mut batch)?;
    /// // ... a learner computes its errors from the batch, weighted by batch.importance_weight() ...
    /// let errors = [0.5_f32; 32];
    /// buffer.set_priorities(batch.transition(), &errors.map(|error| error.abs().powf(0.6)))?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub const fn with_priorities(mut self, beta: Beta) -> Self {
        self.prioritized = Some(beta);
        self
    }

    /// Draws a batch into `batch`, with the generator `rng`, of which one word is used.
    ///
    /// `reward` is called once, with the relabeled rows only, and not at all if there are none.
    /// Rewards are computed in `f64`. If it panics the buffer is unharmed.
    ///
    /// # Errors
    /// [`SampleError`]; the batch is empty then.
    pub fn sample<T, F, R>(
        &self,
        buffer: &HerBuffer<T>,
        reward: &F,
        rng: &mut R,
        batch: &mut Batch<T>,
    ) -> Result<(), SampleError>
    where
        T: Scalar,
        F: GoalReward + ?Sized,
        R: Rng + ?Sized,
    {
        self.draw(&buffer.storage, reward, Draws::new(rng.next_u64()), batch)
    }

    /// Draws the batch that belongs to `seed`. The same seed gives the same batch, whatever was drawn
    /// before.
    ///
    /// # Errors
    /// [`SampleError`]; the batch is empty then.
    pub fn sample_seeded<T, F>(
        &self,
        buffer: &HerBuffer<T>,
        reward: &F,
        seed: u64,
        batch: &mut Batch<T>,
    ) -> Result<(), SampleError>
    where
        T: Scalar,
        F: GoalReward + ?Sized,
    {
        self.draw(&buffer.storage, reward, Draws::new(seed), batch)
    }

    /// [`sample_seeded`](Self::sample_seeded) on the threads of the current rayon pool: the same batch,
    /// whatever their number. The reward function is called on the calling thread.
    ///
    /// Worth it for large batches; one of 512 rows or fewer is drawn on one thread.
    ///
    /// # Errors
    /// [`SampleError`]; the batch is empty then.
    pub fn sample_parallel<T, F>(
        &self,
        buffer: &HerBuffer<T>,
        reward: &F,
        seed: u64,
        batch: &mut Batch<T>,
    ) -> Result<(), SampleError>
    where
        T: Scalar,
        F: GoalReward + ?Sized,
    {
        let (storage, draws) = (&buffer.storage, Draws::new(seed));
        self.draw_with(storage, reward, batch, |rows| match self.table(storage) {
            None => gather_parallel(storage, self, draws, storage.episodes.picker(), rows),
            Some(table) => {
                gather_parallel(storage, self, draws, table.picker(&storage.episodes), rows)
            }
        })
    }

    fn draw<T: Scalar, F: GoalReward + ?Sized>(
        &self,
        storage: &Storage<T>,
        reward: &F,
        draws: Draws,
        batch: &mut Batch<T>,
    ) -> Result<(), SampleError> {
        self.draw_with(storage, reward, batch, |rows| match self.table(storage) {
            None => gather(storage, self, draws, storage.episodes.picker(), rows),
            Some(table) => gather(storage, self, draws, table.picker(&storage.episodes), rows),
        })
    }

    fn draw_with<T: Scalar, F: GoalReward + ?Sized>(
        &self,
        storage: &Storage<T>,
        reward: &F,
        batch: &mut Batch<T>,
        gather: impl FnOnce(&mut Rows<'_, T>) -> Counts,
    ) -> Result<(), SampleError> {
        let drawn = self.check(storage).and_then(|()| {
            let counts = gather(&mut batch.make_room(self, storage));
            batch.part_fields();
            if let Some(beta) = self.prioritized {
                beta.weigh(storage, batch);
            }
            outcome::compute(storage, self, reward, counts, batch)
        });
        if drawn.is_err() {
            batch.clear();
        }
        drawn
    }

    /// The priorities to draw by, or `None` for uniform draws.
    fn table<'a, T>(&self, storage: &'a Storage<T>) -> Option<&'a PriorityTable> {
        storage.priorities.as_ref().filter(|_| self.prioritized.is_some())
    }

    fn check<T: Scalar>(&self, storage: &Storage<T>) -> Result<(), SampleError> {
        if self.batch_size == 0 {
            return Err(SampleError::EmptyBatch);
        }
        if storage.episodes.live().is_empty() {
            return Err(SampleError::NoFinishedEpisode);
        }
        if self.prioritized.is_some() {
            let table = storage.priorities.as_ref().ok_or(SampleError::NoPriorities)?;
            if table.tree.total() == 0.0 {
                return Err(SampleError::ZeroPriorities);
            }
        }
        let Dims { observation, goal, action } = storage.layout.dims();
        let goals = goal.saturating_mul(self.window());
        let most = observation.max(action).max(goals).max(storage.layout.fields().len());
        let bytes = self.batch_size.checked_mul(most).and_then(|n| n.checked_mul(size_of::<f64>()));
        match bytes {
            Some(bytes) if bytes <= isize::MAX.unsigned_abs() => Ok(()),
            _ => Err(SampleError::TooLarge),
        }
    }

    /// The most steps of a row.
    #[inline(always)]
    pub(crate) fn window(&self) -> usize {
        self.n_step.map_or(1, |n_step| n_step.steps.get())
    }
}
