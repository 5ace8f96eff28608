//! The checks before a draw.

use goal_reward::{Dims, Symmetry};

use crate::sample::error::SampleError;
use crate::sample::settings::sampler::Sampler;
use crate::scalar::Scalar;
use crate::store::storage::Storage;
use crate::unit_interval::UnitInterval;

impl Sampler {
    /// Checks the symmetry of a draw, and returns it if rows are mirrored.
    pub(crate) fn check_symmetry<'a>(
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
    pub(crate) fn check<T: Scalar>(&self, storage: &Storage<T>) -> Result<usize, SampleError> {
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
