//! What learns in cycles, and the loop over them.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::curve::{Counters, CurveRow, Target};
use crate::learn::error::{CheckpointError, TrainError};
use crate::learn::settings::train::json_text;
use crate::trained::{AnyPolicy, TrainedPolicyError};
use crate::workers::{Workers, sum};

/// What learns in cycles: a [`Trainer`](crate::learn::Trainer) or a
/// [`Distiller`](crate::learn::Distiller). Its methods are those of both; a
/// [`RunPlan`](crate::runs::RunPlan) takes either through a run.
pub trait Learner {
    /// Returns the counts of the run so far.
    fn counters(&self) -> &Counters;

    /// Returns the rows of the learning curve so far.
    fn rows(&self) -> &[CurveRow];

    /// Returns the seed.
    fn seed(&self) -> u64;

    /// Returns the settings as lines of JSON.
    fn settings_json(&self) -> String;

    /// Returns the number of episodes of an evaluation.
    fn evaluation_episodes(&self) -> usize;

    /// Returns the processes that share the run.
    fn workers(&mut self) -> &mut dyn Workers;

    /// Returns the policy that is evaluated, as it is now.
    ///
    /// # Errors
    /// [`TrainedPolicyError::NotFinite`] if the training has diverged.
    fn any_policy(&self, env_id: &str) -> Result<AnyPolicy, TrainedPolicyError>;

    /// Whether a run of `num_steps` steps has taken them all, with all that follows them.
    fn is_complete(&self, num_steps: u64) -> bool;

    /// Continues a run of `num_steps` steps to the next point at which it can stop, or until `go_on`
    /// returns false; the next call goes on from there. Returns a row of the learning curve if there
    /// was an evaluation.
    ///
    /// # Errors
    /// [`TrainError`].
    fn run_cycle_while(
        &mut self,
        num_steps: u64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<CurveRow>, TrainError>;

    /// Updates `num_updates` times from demonstrations alone, and evaluates.
    ///
    /// # Errors
    /// [`TrainError`].
    fn run_updates(&mut self, num_updates: u64) -> Result<CurveRow, TrainError>;

    /// Whether a run of `num_steps` steps has ended: it is [complete](Self::is_complete), or its
    /// target is reached.
    fn is_over(&self, num_steps: u64, target: Option<Target>) -> bool {
        self.is_complete(num_steps) || target.is_some_and(|target| target.is_reached(self.rows()))
    }
}

/// A [`Learner`] that can be saved, as in environments with snapshots.
pub trait SaveLearner: Learner {
    /// Saves a checkpoint in a folder, as [`Trainer::save`](crate::learn::Trainer::save) does.
    ///
    /// # Errors
    /// [`CheckpointError`].
    fn save(&mut self, folder: &Path) -> Result<PathBuf, CheckpointError>;
}

/// Runs a learner until its run is over, or `watch` breaks in any process.
pub(crate) fn run<L: Learner>(
    learner: &mut L,
    num_steps: u64,
    target: Option<Target>,
    mut watch: impl FnMut(&mut L, &CurveRow) -> ControlFlow<()>,
) -> Result<(), TrainError> {
    while !learner.is_over(num_steps, target) {
        if let Some(row) = learner.run_cycle_while(num_steps, &mut || true)? {
            let is_over = watch(learner, &row).is_break();
            if sum(learner.workers(), u64::from(is_over))? > 0 {
                break;
            }
        }
    }
    Ok(())
}

/// Checks that the run resumed from a folder has these settings and this seed.
pub(crate) fn check_same(
    learner: &(impl Learner + ?Sized),
    settings: &impl Serialize,
    seed: u64,
    folder: &Path,
) -> Result<(), CheckpointError> {
    let what = match (learner.seed(), learner.settings_json()) {
        (other, _) if other != seed => format!("the seed {other}"),
        (_, other) if other != json_text(settings) => "other settings".to_owned(),
        _ => return Ok(()),
    };
    Err(CheckpointError::OtherSettings { folder: folder.to_owned(), what })
}
