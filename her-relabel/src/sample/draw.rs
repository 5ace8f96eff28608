//! Drawing a batch: which transitions, which goals, what rewards.

use goal_reward::GoalReward;

use crate::sample::batch::Batch;
use crate::sample::draws::{Draws, RandomSource, by_priority, uniform};
use crate::sample::gather::{PART, gather_parts};
use crate::sample::outcome;
use crate::sample::sampler::{SampleError, Sampler};
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;
use crate::store::config::Dims;
use crate::store::storage::Storage;

impl Sampler {
    /// Draws a batch into `batch`, with random numbers from `source`: a `u64` seed, or `&mut` a generator,
    /// of which one word is used. The same seed gives the same batch, whatever was drawn before.
    ///
    /// `reward` is called once, with the relabeled rows only, and not at all if there are none.
    /// Rewards are computed in `f64`. If it panics the buffer is unharmed.
    ///
    /// # Errors
    /// [`SampleError`]; then the batch is empty.
    pub fn sample<T, F>(
        &self,
        buffer: &HerBuffer<T>,
        reward: &F,
        source: impl RandomSource,
        batch: &mut Batch<T>,
    ) -> Result<(), SampleError>
    where
        T: Scalar,
        F: GoalReward + ?Sized,
    {
        let drawn = self.draw(&buffer.storage, reward, Draws::new(source.seed()), batch);
        if drawn.is_err() {
            batch.clear();
        }
        drawn
    }

    fn draw<T: Scalar, F: GoalReward + ?Sized>(
        &self,
        storage: &Storage<T>,
        reward: &F,
        draws: Draws,
        batch: &mut Batch<T>,
    ) -> Result<(), SampleError> {
        self.check(storage)?;
        let mut rows = batch.make_room(self, storage);
        let part = if self.parallel() { PART } else { usize::MAX };
        let episodes = &storage.episodes;
        let table = storage.priorities.as_ref().filter(|_| self.priorities().is_some());
        let counts = match table {
            None => {
                let pick = |word| uniform(episodes, word);
                gather_parts(storage, self, draws, pick, &mut rows, part)
            }
            Some(table) => {
                let pick = |word| by_priority(table, episodes, word);
                gather_parts(storage, self, draws, pick, &mut rows, part)
            }
        };
        batch.separate_fields();
        if let Some(beta) = self.priorities() {
            outcome::weigh(beta, storage, batch);
        }
        outcome::compute(storage, self, reward, counts, batch)
    }

    fn check<T: Scalar>(&self, storage: &Storage<T>) -> Result<(), SampleError> {
        if self.batch_size() == 0 {
            return Err(SampleError::EmptyBatch);
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
        let goals = goal.saturating_mul(self.window());
        let most = observation.max(action).max(goals).max(storage.layout.fields().len());
        let size = size_of::<f64>();
        let bytes = self.batch_size().checked_mul(most).and_then(|count| count.checked_mul(size));
        match bytes {
            Some(bytes) if bytes <= isize::MAX.unsigned_abs() => Ok(()),
            _ => Err(SampleError::TooLarge),
        }
    }
}
