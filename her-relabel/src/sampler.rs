//! Drawing batches: which transitions, which goals, what rewards.

use goal_reward::{GoalError, GoalPairs, GoalReward};
use rand_core::Rng;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::draws::{Draws, Purpose, below, unit};
use crate::episodes::Episode;
use crate::storage::{Storage, TransitionId};
use crate::{Batch, GoalStrategy, HerBuffer, RelabelRatio, Scalar};

/// How batches are drawn. A small value: to change something for one call, use another, such as
/// `sampler.with_ratio(RelabelRatio::NONE)`.
///
/// Every row is drawn on its own: a live transition, uniformly and with replacement; then, with the
/// probability of the ratio, a new goal by the strategy. A relabelled row gets the new goal and
/// the reward `f(next_achieved_goal, new_goal)`; everything else in it, and all of the other rows, is
/// as it was stored.
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
    pub strategy: GoalStrategy,
    /// The share of rows that get one.
    pub ratio: RelabelRatio,
}

impl Sampler {
    /// Batches of `batch_size` rows.
    #[must_use]
    pub const fn new(batch_size: usize, strategy: GoalStrategy, ratio: RelabelRatio) -> Self {
        Self { batch_size, strategy, ratio }
    }

    /// The same with batches of `batch_size` rows.
    #[must_use]
    pub const fn with_batch_size(mut self, batch_size: usize) -> Self {
        self.batch_size = batch_size;
        self
    }

    /// The same with new goals by `strategy`.
    #[must_use]
    pub const fn with_strategy(mut self, strategy: GoalStrategy) -> Self {
        self.strategy = strategy;
        self
    }

    /// The same with the share `ratio` of new goals.
    #[must_use]
    pub const fn with_ratio(mut self, ratio: RelabelRatio) -> Self {
        self.ratio = ratio;
        self
    }

    /// Draws a batch into `batch`, with the generator `rng`, of which one word is used.
    ///
    /// `reward` is called once, with the relabelled rows only, and not at all if there are none.
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

    fn draw<T: Scalar, F: GoalReward + ?Sized>(
        &self,
        storage: &Storage<T>,
        reward: &F,
        draws: Draws,
        batch: &mut Batch<T>,
    ) -> Result<(), SampleError> {
        let dims = storage.layout.dims();
        batch.resize(0, dims);
        batch.relabelled.clear();
        if self.batch_size == 0 {
            return Err(SampleError::EmptyBatch);
        }
        let live = storage.episodes.live();
        if live.is_empty() {
            return Err(SampleError::NoFinishedEpisode);
        }
        batch.resize(self.batch_size, dims);
        for row in 0..self.batch_size {
            let word = draws.word(row, Purpose::Transition);
            let transition = live.start + below(word, live.end - live.start);
            let episode = storage.episodes.of(transition);
            let relabel = unit(draws.word(row, Purpose::Relabel)) < self.ratio.get();
            let source = relabel.then(|| {
                self.strategy.source(transition, &episode, draws.word(row, Purpose::Goal))
            });
            gather(storage, &episode, transition, source, row, batch);
        }
        let rewarded = reward_relabelled(reward, dims.goal, batch);
        batch.relabelled.clear();
        if rewarded.is_err() {
            batch.resize(0, dims);
        }
        rewarded
    }
}

/// Copies a transition to row `row` of the batch.
#[inline(always)]
fn gather<T: Scalar>(
    storage: &Storage<T>,
    episode: &Episode,
    transition: u64,
    source: Option<u64>,
    row: usize,
    batch: &mut Batch<T>,
) {
    let Storage { layout, tape, .. } = storage;
    let state = tape.row(episode.row(transition));
    let next = tape.row(episode.row(transition) + 1);
    let goal = match source {
        Some(source) => &tape.row(episode.row(source) + 1)[layout.achieved_goal()],
        None => &tape.row(episode.last_row())[layout.desired_goal()],
    };
    put(&mut batch.observation, row, &state[layout.observation()]);
    put(&mut batch.achieved_goal, row, &state[layout.achieved_goal()]);
    put(&mut batch.desired_goal, row, goal);
    put(&mut batch.action, row, &state[layout.action()]);
    batch.reward[row] = state[layout.reward()];
    put(&mut batch.next_observation, row, &next[layout.observation()]);
    put(&mut batch.next_achieved_goal, row, &next[layout.achieved_goal()]);
    let is_last = transition + 1 == episode.live.end;
    batch.terminated[row] = is_last && episode.ending.terminated;
    batch.truncated[row] = is_last && episode.ending.truncated;
    batch.transition[row] = TransitionId::of(transition);
    batch.goal_source[row] = source.map(TransitionId::of);
    if source.is_some() {
        batch.relabelled.rows.push(row);
        batch
            .relabelled
            .next_achieved_goal
            .extend(next[layout.achieved_goal()].iter().map(|value| value.to_f64()));
        batch.relabelled.desired_goal.extend(goal.iter().map(|value| value.to_f64()));
    }
}

#[inline(always)]
fn put<T: Copy>(column: &mut [T], row: usize, values: &[T]) {
    column[row * values.len()..][..values.len()].copy_from_slice(values);
}

/// Computes the rewards of the relabelled rows and puts them where they belong.
fn reward_relabelled<T: Scalar, F: GoalReward + ?Sized>(
    reward: &F,
    goal_dim: usize,
    batch: &mut Batch<T>,
) -> Result<(), SampleError> {
    let relabelled = &mut batch.relabelled;
    if relabelled.rows.is_empty() {
        return Ok(());
    }
    let pairs = GoalPairs::new(&relabelled.next_achieved_goal, &relabelled.desired_goal, goal_dim)?;
    relabelled.reward.resize(relabelled.rows.len(), f64::NAN);
    reward.reward_batch(pairs, &mut relabelled.reward)?;
    for (row, reward) in relabelled.rows.iter().zip(&relabelled.reward) {
        let rounded = T::from_f64(*reward);
        if !rounded.to_f64().is_finite() {
            return Err(SampleError::RewardNotFinite { row: *row, reward: *reward });
        }
        batch.reward[*row] = rounded;
    }
    Ok(())
}

/// Why no batch can be drawn.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SampleError {
    /// A batch of no rows was asked for.
    #[error("`batch_size` is 0; ask for at least one row")]
    EmptyBatch,
    /// Nothing is stored yet.
    #[error(
        "the buffer holds no finished episode, and only finished episodes can be relabelled; step \
         the environments until one ends, or call end_episode"
    )]
    NoFinishedEpisode,
    /// The reward function refused the goals of the batch.
    #[error("the reward function failed on the relabelled goals: {0}")]
    Reward(#[from] GoalError),
    /// The reward function gave NaN or infinity, or a number beyond the buffer's type.
    #[error(
        "the reward of row {row} is {reward}, which the buffer's type cannot hold as a finite \
         number; check the reward function"
    )]
    RewardNotFinite {
        /// The row of the batch.
        row: usize,
        /// The reward.
        reward: f64,
    },
}
