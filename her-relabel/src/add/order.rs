//! The order of rows: each continues the one before it.

use crate::add::arguments::{RowNumbers, StepRows};
use crate::add::check::AddError;
use crate::scalar::Scalar;
use crate::store::buffer::HerBuffer;

impl<T: Scalar> HerBuffer<T> {
    /// Checks that every step continues the episode of its environment, or one that was discarded,
    /// and that no row with a number is recorded twice.
    pub(crate) fn check_order<O, G, A>(
        &self,
        rows: &StepRows<'_, O, G, A>,
    ) -> Result<(), AddError> {
        for (at, &env_index) in rows.env_index.iter().enumerate() {
            let episode = &self.unfinished[env_index];
            let is_under_way = episode.is_under_way();
            if rows.stepped[at] && (is_under_way || !episode.is_discarded) {
                if let Some(numbers) = &rows.numbers {
                    self.check_next(numbers, at, env_index)?;
                }
                if !is_under_way {
                    return Err(AddError::NoEpisode { env_index });
                }
            } else if rows.started[at]
                && is_under_way
                && let Some(numbers) = &rows.numbers
                && episode.newest == Some(numbers.row(at))
            {
                return Err(AddError::RecordedBefore { env_index });
            }
        }
        Ok(())
    }

    /// Checks that the row at `at` follows the newest one of its environment.
    fn check_next(
        &self,
        numbers: &RowNumbers<'_>,
        at: usize,
        env_index: usize,
    ) -> Result<(), AddError> {
        let (episode, row) = (&self.unfinished[env_index], numbers.row(at));
        let Some(newest) = episode.newest.filter(|newest| newest.source == row.source) else {
            let is_other = episode.is_under_way();
            return if is_other { Err(AddError::OtherEpisode { env_index }) } else { Ok(()) };
        };
        match row.number.checked_sub(newest.number) {
            None | Some(0) => Err(AddError::RecordedBefore { env_index }),
            Some(1) => Ok(()),
            Some(later) => Err(AddError::RowsMissing { env_index, missing: later - 1 }),
        }
    }
}
