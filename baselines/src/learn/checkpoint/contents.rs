//! What a checkpoint may hold: what no run leaves behind is damage.

use super::{Own, Saved};
use crate::evaluate::MAX_COUNT;

impl Saved {
    /// Checks what all processes have in common.
    pub(super) fn check(&self) -> Result<(), String> {
        if self.num_ranks == 0 {
            return Err("it is of no process".to_owned());
        }
        self.settings.check().map_err(|error| error.to_string())?;
        for row in &self.rows {
            check_counts(row.counters.counts())?;
        }
        check_counts(self.counters.counts())?;
        check_counts(self.recent.counts())?;
        if self.num_updates != self.counters.updates {
            let (networks, run) = (self.num_updates, self.counters.updates);
            return Err(format!("its networks have had {networks} updates, and its run {run}"));
        }
        if !self.inputs.have(&self.settings.inputs) {
            return Err("its networks have other inputs than its settings say".to_owned());
        }
        Ok(())
    }
}

impl<S> Own<S> {
    /// Checks what a process has for itself; environments check their snapshots themselves.
    pub(super) fn check(&self) -> Result<(), String> {
        check_counts(self.explorer.counts())
    }
}

fn check_counts<const N: usize>(counts: [(&str, u64); N]) -> Result<(), String> {
    match counts.iter().find(|(_, count)| *count > MAX_COUNT) {
        Some((what, count)) => Err(format!("it is of {count} {what}")),
        None => Ok(()),
    }
}

/// Checks the numbers of a tensor of the networks or of their optimizers.
pub(super) fn check_numbers(tensor: &str, numbers: &[f32]) -> Result<(), String> {
    // Means of squares.
    let is_square = tensor.ends_with(".second_moment");
    let is_bad = |number: &f32| !number.is_finite() || (is_square && *number < 0.0);
    match numbers.iter().position(is_bad) {
        Some(index) => Err(format!("the tensor {tensor} has {} at {index}", numbers[index])),
        None => Ok(()),
    }
}
