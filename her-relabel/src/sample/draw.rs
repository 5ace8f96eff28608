//! Drawing a batch: its transitions, goals and rewards.

use std::any::Any;

use goal_reward::{GoalReward, Symmetry};

use crate::sample::aim::Task;
use crate::sample::batch::{Batch, ColumnsMut, Judged, Rows, ScratchRows};
use crate::sample::columns::Widths;
use crate::sample::draws::{Draws, RandomSource, by_priority, uniform};
use crate::sample::form::{AsStored, Form, Formed};
use crate::sample::gather::PART;
use crate::sample::inputs::{JoinedGoal, Normalizers, Transforms};
use crate::sample::mirror::Mirroring;
use crate::sample::outcome;
use crate::sample::redraw::Redraws;
use crate::sample::sampler::{SampleError, Sampler};
use crate::sample::threads::have_threads;
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;
use crate::store::config::Dims;
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
        let draws = Draws::new(source.seed());
        let unfinished = ClearOnDrop(batch);
        let batch = &mut *unfinished.0;
        let storage = &buffer.storage;
        let window = self.check(storage)?;
        batch.follow_fields(&storage.fields);
        let Transforms { normalizers: Normalizers { observation, goal }, symmetry } =
            transforms.into();
        let relative = self.joined_goal() == Some(JoinedGoal::Relative);
        let form = Formed { observation, goal, relative };
        form.check(storage.layout.dims())?;
        let symmetry = self.check_symmetry(symmetry, storage.layout.dims())?;
        // The storage in the batch's type, if the batch takes everything as it is stored.
        let is_plain = form.is_plain() && symmetry.is_none();
        let as_stored = (storage as &dyn Any).downcast_ref().filter(|_| is_plain);
        let widths = Widths::of(self, &storage.layout, window, as_stored.is_some());
        let size = self.batch_size();
        let Batch { scratch, judged, redraws, .. } = batch;
        let columns = batch.columns.resize(size, &widths, columns)?;
        let scratch = scratch.resize(size, &widths, ScratchRows::default())?;
        let mut rows = Rows { widths, first: 0, columns, scratch };
        let memory = (&mut rows, judged, redraws);
        match (as_stored, self.joined_goal().is_some()) {
            (Some(storage), false) => {
                self.fill::<T, T, F>(storage, reward, draws, AsStored::<false>, memory)?;
            }
            (Some(storage), true) => {
                self.fill::<T, T, F>(storage, reward, draws, AsStored::<true>, memory)?;
            }
            (None, _) => match symmetry {
                None => self.fill(storage, reward, draws, form, memory)?,
                Some(symmetry) => {
                    let form = Mirroring::new(form, symmetry, self.mirrored(), draws);
                    self.fill(storage, reward, draws, form, memory)?;
                }
            },
        }
        batch.len = size;
        batch.separate_fields()?;
        std::mem::forget(unfinished);
        Ok(())
    }

    /// Draws rows and computes their outcomes.
    fn fill<S: Scalar, T: Scalar, F: GoalReward + ?Sized>(
        &self,
        storage: &Storage<S>,
        reward: &F,
        draws: Draws,
        form: impl Form<S, T>,
        (rows, judged, redraws): (&mut Rows<'_, T>, &mut Judged, &mut Redraws),
    ) -> Result<(), SampleError> {
        let task = Task { storage, sampler: self };
        let part = if self.parallel() && have_threads() { PART } else { usize::MAX };
        let episodes = &storage.episodes;
        let table = storage.priorities.as_ref().filter(|_| self.priorities().is_some());
        let keeps_all = self.already_achieved() == UnitInterval::ONE;
        let counts = match (table, keeps_all) {
            (None, true) => {
                let pick = |word| uniform(episodes, word);
                task.gather_moved(draws, pick, form, rows, part)
            }
            (Some(table), true) => {
                let pick = |word| by_priority(table, episodes, word);
                task.gather_moved(draws, pick, form, rows, part)
            }
            (None, false) => {
                let pick = |word| uniform(episodes, word);
                let words = redraws.choose(task, reward, draws, pick)?;
                task.gather_moved(words, pick, form, rows, part)
            }
            (Some(table), false) => {
                let pick = |word| by_priority(table, episodes, word);
                let words = redraws.choose(task, reward, draws, pick)?;
                task.gather_moved(words, pick, form, rows, part)
            }
        };
        if let Some(beta) = self.priorities() {
            outcome::weigh(beta, storage, rows, judged)?;
        }
        outcome::compute(task, reward, form, counts, rows, judged)
    }

    /// Checks the symmetry of a draw, and returns it if rows are mirrored.
    fn check_symmetry<'a>(
        &self,
        symmetry: Option<&'a Symmetry>,
        dims: Dims,
    ) -> Result<Option<&'a Symmetry>, SampleError> {
        if self.mirrored() == UnitInterval::ZERO {
            return Ok(None);
        }
        let symmetry = symmetry.ok_or(SampleError::NoSymmetry)?;
        let Symmetry { observation, goal, action } = symmetry;
        let expected = [dims.observation, dims.goal, dims.action];
        for (expected, actual) in expected.into_iter().zip([observation, goal, action]) {
            if actual.len() != expected {
                return Err(SampleError::SymmetryDim { expected, actual: actual.len() });
            }
        }
        Ok(Some(symmetry))
    }

    /// Checks that a batch can be drawn, and returns the maximal number of steps of its rows.
    fn check<T: Scalar>(&self, storage: &Storage<T>) -> Result<usize, SampleError> {
        if self.batch_size() == 0 {
            return Err(SampleError::EmptyBatch);
        }
        if let Some(noise) = self.goal_noise().filter(|noise| !noise.is_valid()) {
            return Err(SampleError::BadRadius { radius: noise.radius() });
        }
        if storage.episodes.live().is_empty() {
            return Err(SampleError::NoFinishedEpisode);
        }
        if self.priorities().is_some() {
            let table = storage.priorities.as_ref().ok_or(SampleError::NoPriorities)?;
            if table.tree.total() == 0.0 {
                return Err(SampleError::ZeroPriorities);
            }
        }
        let Dims { observation, goal, action } = storage.layout.dims();
        // Windows longer than the longest episode need no more memory.
        let window = self.window().min(storage.episodes.longest() as usize);
        let goals = goal.saturating_mul(window);
        let input = observation.saturating_add(goal);
        // A mirrored row has both goals.
        let most =
            input.saturating_add(goal).max(action).max(goals).max(storage.layout.fields().len());
        // Reserving the memory finds out whether there is enough.
        let elements = self.batch_size().checked_mul(most);
        elements.map(|_| window).ok_or(SampleError::TooLarge)
    }
}
