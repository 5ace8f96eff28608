//! Drawing a batch: its transitions, goals and rewards.

mod check;
mod chosen_goal;
mod gather;
mod moved;
mod outcome;
mod redraw;

use std::any::Any;

use goal_reward::GoalReward;

use crate::sample::draw::chosen_goal::Draw;
use crate::sample::draw::gather::Counts;
use crate::sample::error::SampleError;
use crate::sample::random::{BatchWords, RandomSource, Words, by_priority, uniform};
use crate::sample::rows::batch::{Batch, ColumnsMut, Rows, ScratchRows, Workspace};
use crate::sample::rows::columns::Widths;
use crate::sample::rows::form::{AsStored, Form, Formed};
use crate::sample::rows::mirror::Mirroring;
use crate::sample::settings::inputs::{JoinedGoal, Normalizers, Transforms};
use crate::sample::settings::sampler::Sampler;
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;
use crate::store::storage::Storage;
use crate::unit_interval::UnitInterval;

/// A batch that is emptied on drop unless it was completed, even if the reward function panics.
struct ClearOnDrop<'a, T>(&'a mut Batch<T>);

impl<T> Drop for ClearOnDrop<'_, T> {
    fn drop(&mut self) {
        self.0.clear();
    }
}

impl Sampler {
    /// Draws a batch into `batch`, with random numbers from `source`: a `u64` seed, or a `&mut`
    /// generator, of which one word is used. The same seed always gives the same batch of a buffer.
    ///
    /// The element type of the batch need not be that of the buffer.
    ///
    /// `reward` is called once, with the relabeled rows, and not at all if there are none. Rewards
    /// are computed in `f64`, from the buffer's own numbers. If `reward` panics, the batch is
    /// empty.
    ///
    /// # Errors
    /// [`SampleError`]; then the batch is empty.
    pub fn sample<S: Scalar, T: Scalar, F: GoalReward + ?Sized>(
        &self,
        buffer: &HerBuffer<S>,
        reward: &F,
        source: impl RandomSource,
        batch: &mut Batch<T>,
    ) -> Result<(), SampleError> {
        let (transforms, columns) = (Transforms::default(), ColumnsMut::default());
        self.sample_into(buffer, reward, source, batch, transforms, columns)
    }

    /// Draws a batch as [`sample`](Self::sample) does, but writes the columns for which `columns`
    /// has memory, such as tensors or pinned memory, to that memory, and the others to `batch`.
    /// `transforms` mirrors and normalizes observations and goals; you can also pass
    /// [`Normalizers`] alone.
    ///
    /// # Errors
    /// [`SampleError`]; then the batch is empty, and the contents of `columns` are unspecified.
    ///
    /// # Example
    /// ```
    /// use goal_reward::DistanceReward;
    /// use her_relabel::{Batch, BufferConfig, ColumnsMut, Dims, EpisodeData, GoalStrategy, HerBuffer};
    /// use her_relabel::{JoinedGoal, Normalizer, NormalizerConfig, Normalizers, Sampler};
    /// use her_relabel::UnitInterval;
    ///
    /// let config = BufferConfig::new(1000, Dims { observation: 2, goal: 1, action: 1 });
    /// let mut buffer = HerBuffer::<f64>::new(config)?;
    /// let episode = EpisodeData {
    ///     observation: &[0.0, 10.0, 2.0, 30.0],
    ///     achieved_goal: &[0.0, 1.0],
    ///     desired_goal: &[9.0],
    ///     action: &[0.5_f32],
    ///     reward: &[-1.0],
    ///     terminated: true,
    ///     truncated: false,
    ///     fields: &[],
    /// };
    /// buffer.add_episode(&episode)?;
    /// let mut observation = Normalizer::new(NormalizerConfig::new(2))?;
    /// observation.update(episode.observation)?; // mean (1, 20), standard deviation (1, 10)
    /// let normalizers = Normalizers { observation: Some(&observation), goal: None };
    ///
    /// let sampler = Sampler::new(1, GoalStrategy::Future, UnitInterval::ONE)
    ///     .with_joined_goal(JoinedGoal::Relative)
    ///     .with_discount(UnitInterval::new(0.98)?);
    /// // The memory of three tensors.
    /// let (mut input, mut next_input, mut discount) = ([0.0_f32; 3], [0.0; 3], [0.0; 1]);
    /// let columns = ColumnsMut {
    ///     input: &mut input,
    ///     next_input: &mut next_input,
    ///     discount: &mut discount,
    ///     ..ColumnsMut::default()
    /// };
    /// let mut batch = Batch::new();
    /// let reward = DistanceReward::sparse();
    /// sampler.sample_into(&buffer, &reward, 7, &mut batch, normalizers, columns)?;
    /// // Observations are normalized; the new goal, 1, was one away before the step.
    /// assert_eq!(input, [-1.0, -1.0, 1.0]);
    /// assert_eq!(next_input, [1.0, 1.0, 0.0]);
    /// assert_eq!((discount, batch.reward()), ([0.0], &[0.0][..]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn sample_into<'a, S: Scalar, T: Scalar, F: GoalReward + ?Sized>(
        &self,
        buffer: &HerBuffer<S>,
        reward: &F,
        source: impl RandomSource,
        batch: &mut Batch<T>,
        transforms: impl Into<Transforms<'a>>,
        columns: ColumnsMut<'_, T>,
    ) -> Result<(), SampleError> {
        let (reward, words) = (&reward as &dyn GoalReward, BatchWords::new(source.seed()));
        self.sample_rows(buffer, reward, words, batch, transforms.into(), columns)
    }

    /// Draws a batch for any reward: so this code, which is much, is compiled once, and not again in
    /// each crate that draws.
    #[inline(never)]
    fn sample_rows<S: Scalar, T: Scalar>(
        &self,
        buffer: &HerBuffer<S>,
        reward: &dyn GoalReward,
        words: BatchWords,
        batch: &mut Batch<T>,
        transforms: Transforms<'_>,
        columns: ColumnsMut<'_, T>,
    ) -> Result<(), SampleError> {
        let unfinished = ClearOnDrop(batch);
        let batch = &mut *unfinished.0;
        let storage = &buffer.storage;
        let draw = Draw { storage, sampler: self };
        let window = self.check(storage)?;
        batch.follow_fields(&storage.fields);
        let Transforms { normalizers: Normalizers { observation, goal }, symmetry } = transforms;
        let relative = self.joined_goal() == Some(JoinedGoal::Relative);
        let form = Formed { observation, goal, relative };
        form.check(storage.layout.dims())?;
        let symmetry = self.check_symmetry(symmetry, storage.layout.dims())?;
        // The storage in the batch's type, if the batch takes everything as it is stored.
        let is_plain = form.is_plain() && symmetry.is_none();
        let as_stored = (storage as &dyn Any).downcast_ref().filter(|_| is_plain);
        let widths = Widths::of(self, &storage.layout, window, as_stored.is_some());
        let size = self.batch_size();
        let Batch { scratch, workspace, .. } = batch;
        let columns = batch.columns.resize(size, &widths, columns)?;
        let scratch = scratch.resize(size, &widths, ScratchRows::default())?;
        let rows = &mut Rows { widths, first: 0, columns, scratch };
        match (as_stored, symmetry) {
            (Some(storage), _) => {
                let draw = Draw::<T> { storage, sampler: self };
                if self.joined_goal().is_some() {
                    draw.fill(reward, words, AsStored::<true>, rows, workspace)?;
                } else {
                    draw.fill(reward, words, AsStored::<false>, rows, workspace)?;
                }
            }
            (None, None) => draw.fill(reward, words, form, rows, workspace)?,
            (None, Some(symmetry)) => {
                let form = Mirroring::new(form, symmetry, self.mirrored(), words);
                draw.fill(reward, words, form, rows, workspace)?;
            }
        }
        batch.len = size;
        batch.separate_fields()?;
        std::mem::forget(unfinished);
        Ok(())
    }
}

impl<S: Scalar> Draw<'_, S> {
    /// Draws all rows, in the form `form`.
    fn fill<T: Scalar>(
        self,
        reward: &dyn GoalReward,
        words: BatchWords,
        form: impl Form<S, T>,
        rows: &mut Rows<'_, T>,
        workspace: &mut Workspace,
    ) -> Result<(), SampleError> {
        let Storage { episodes, priorities, .. } = self.storage;
        // One loop over the rows for each way to pick, instead of a choice in each row.
        let counts = match priorities.as_ref().filter(|_| self.sampler.priorities().is_some()) {
            None => {
                let pick = |word| uniform(episodes, word);
                self.gather_by(pick, reward, words, form, rows, workspace)?
            }
            Some(table) => {
                let pick = |word| by_priority(table, episodes, word);
                self.gather_by(pick, reward, words, form, rows, workspace)?
            }
        };
        if let Some(beta) = self.sampler.priorities() {
            outcome::weigh(beta, self.storage, rows, workspace)?;
        }
        outcome::compute(self, reward, form, counts, rows, workspace)
    }

    /// Draws the goals of all rows, and copies these rows from the transitions that `pick` chooses.
    fn gather_by<T: Scalar>(
        self,
        pick: impl Fn(u64) -> u64 + Copy + Sync,
        reward: &dyn GoalReward,
        words: BatchWords,
        form: impl Form<S, T>,
        rows: &mut Rows<'_, T>,
        workspace: &mut Workspace,
    ) -> Result<Counts, SampleError> {
        if self.sampler.keep_already_achieved() == UnitInterval::ONE {
            return Ok(self.gather_moved(pick, words, form, rows));
        }
        let words = self.redraw(pick, reward, words, rows, workspace)?;
        Ok(self.gather_moved(pick, words, form, rows))
    }

    /// Gathers all rows, and moves some of their new goals.
    fn gather_moved<T: Scalar>(
        self,
        pick: impl Fn(u64) -> u64 + Copy + Sync,
        words: impl Words,
        form: impl Form<S, T>,
        rows: &mut Rows<'_, T>,
    ) -> Counts {
        let counts = self.gather(pick, words, form, rows);
        if let Some(noise) = self.sampler.goal_noise() {
            self.move_goals(noise, words, form, counts, rows);
        }
        counts
    }
}
