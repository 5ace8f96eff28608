//! The evaluations of a run.

use fetch_env::GoalObservation;
use fetch_env::vec_env::{VecStep, VecStepOf};
use her_relabel::Scalar;

use super::curve::CurveRow;
use super::env::LearnEnv;
use super::trainer::Trainer;
use crate::across_workers::gather_episodes;
use crate::evaluate::{Episode, evaluate_range};
use crate::learn::error::{RunError, TrainError};
use crate::policy::VecPolicy;
use crate::workers::{agree, share};

/// The seed of the first evaluation's first episode. The seeds of training are below 2^40, except
/// those of far starts.
pub(crate) const EVALUATION_SEED: u64 = 1 << 41;

impl<E: LearnEnv> Trainer<E> {
    /// Evaluates the greedy policy, as [`policy`](Self::policy) returns it, on episodes that no
    /// other evaluation uses; of a trainer [with pixels](Self::with_pixels) the one that sees them.
    ///
    /// # Errors
    /// [`TrainError::Policy`], [`TrainError::Evaluate`], [`TrainError::Forked`],
    /// [`TrainError::Run`] with [`RunError::EvaluationNotFinite`], and
    /// [`TrainError::Disagreement`] if the processes of a run have different weights.
    pub fn evaluate(&mut self) -> Result<CurveRow, TrainError> {
        self.evaluate_while(&mut || true)
    }

    /// Evaluates as [`evaluate`](Self::evaluate) does while `go_on` returns true, and otherwise
    /// fails with [`EvaluationError::Stopped`](crate::EvaluationError::Stopped).
    pub(super) fn evaluate_while(
        &mut self,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<CurveRow, TrainError> {
        self.updates.check_process()?;
        let count = self.settings.schedule.evaluation_episodes;
        let seed = EVALUATION_SEED + self.counters.evaluations * count as u64;
        // The name matters only in a file.
        let mut policy = self.policy("")?;
        let mut first_bad = None;
        let eyes = &mut self.eyes;
        let mut greedy = |batch: &VecStepOf<E>, actions: &mut [f32]| {
            first_bad = first_bad.or_else(|| first_not_finite(batch));
            match eyes {
                Some(eyes) => eyes.act(batch, actions),
                None => policy.act_all(batch, actions),
            }
        };
        let own = share(&*self.workers, count);
        let envs = &mut self.evaluation_envs;
        let evaluation = evaluate_range(envs, &mut greedy, own, seed, |_| (), go_on);
        // The cause of what may follow: the policy cannot act on such an observation.
        if let Some(env_index) = first_bad {
            let what = "an observation";
            return Err(self.failed(RunError::EvaluationNotFinite { env_index, what }));
        }
        let evaluation = evaluation?;
        let is_bad = |episode: &Episode| !episode.episode_return.is_finite();
        if let Some(row) = evaluation.episodes.iter().position(is_bad) {
            let (env_index, what) = (row % self.evaluation_envs.num_envs(), "a reward");
            return Err(self.failed(RunError::EvaluationNotFinite { env_index, what }));
        }
        self.counters.evaluations += 1;
        let summary = gather_episodes(&mut *self.workers, &evaluation)?.summary()?;
        let diagnostics = self.diagnostics()?;
        let recent = std::mem::take(&mut self.recent);
        let row = CurveRow {
            counters: self.counters,
            success_rate: summary.success_rate,
            episode_return_mean: summary.episode_return_mean.value,
            final_distance_mean: summary.final_distance_mean.value,
            collected_success: recent.success_rate(),
            losses: recent.losses(),
            diagnostics,
        };
        self.rows.push(row.clone());
        self.check_weights()?;
        Ok(row)
    }

    /// Checks that all processes have the same weights.
    fn check_weights(&mut self) -> Result<(), TrainError> {
        if self.workers.size() == 1 {
            return Ok(());
        }
        let checksum = format!("{:016x}", self.updates.checksum());
        Ok(agree(&mut *self.workers, &[("checksum of its weights", checksum)])?)
    }
}

/// Returns the first environment that observes a number that is not finite.
fn first_not_finite<O: GoalObservation<Element: Scalar>, I>(
    batch: &VecStep<O, I>,
) -> Option<usize> {
    let row = |index: usize, len: usize| index * batch.len() / len;
    let observations = batch.observation();
    let observation = observations.iter().position(|number| !number.to_f64().is_finite());
    let observation = observation.map(|index| row(index, observations.len()));
    let goals = [batch.achieved_goal(), batch.desired_goal()].into_iter().filter_map(|goals| {
        let index = goals.iter().position(|number| !number.is_finite());
        index.map(|index| row(index, goals.len()))
    });
    observation.into_iter().chain(goals).min()
}
