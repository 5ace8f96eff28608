//! The end of a run: its final evaluation, its policy and its page.

use std::fmt;

use fetch_env::{EnvId, make_vec_while, vec_env::VecConfig};
use serde::Serialize;

use super::envs::MakeEnvs;
#[cfg(feature = "render")]
use super::envs::{maker, maker_with_pictures};
use super::error::RunsError;
use super::folder::RunFolder;
#[cfg(feature = "page")]
use super::page;
use super::plan::RunPlan;
use crate::across_workers::gather_episodes;
use crate::evaluate::evaluate_range;
#[cfg(feature = "render")]
use crate::learn::vec_env;
use crate::learn::{Counters, Learner};
use crate::trained::{AnyPolicy, SuccessRate};
use crate::workers::share;

/// The first seed of the final evaluation, whose seeds no training and no other evaluation uses.
const FINAL_SEED: u64 = 1 << 50;
/// The number of environments that it steps together.
const FINAL_ENVS: usize = 20;

/// The result of a run.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Outcome {
    /// The environment.
    pub env_id: EnvId,
    /// The seed.
    pub seed: u64,
    /// The counters at the end.
    pub counters: Counters,
    /// The success rate at which the run ends; more than 1 for none.
    pub target: f64,
    /// The counters at the evaluation with which the target was reached.
    pub reached: Option<Counters>,
    /// The success rate of the policy on new seeds.
    pub success: Option<SuccessRate>,
    /// The mean return of the same episodes as `success`.
    pub episode_return_mean: f64,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { env_id, seed, counters, reached, success, .. } = self;
        write!(f, "{env_id}, seed {seed}: ")?;
        match reached {
            Some(Counters { steps, seconds, .. }) => {
                write!(f, "reached the target after {steps} steps, {seconds:.1} s of training")?;
            }
            None => write!(f, "{} steps, {:.1} s of training", counters.steps, counters.seconds)?,
        }
        if let Some(SuccessRate { rate, episodes, .. }) = success {
            write!(f, "; {:.2} of {episodes} episodes on new seeds succeed", rate.value)?;
        }
        Ok(())
    }
}

impl RunPlan {
    /// Ends the run of a [`Trainer`](crate::learn::Trainer) or of a [`Student`](super::Student):
    /// measures its policy on seeds that no training has seen, each process its share of them, and
    /// writes the policy and, with the feature `page`, the page. `num_threads` threads step the
    /// environments. `go_on` is called before each step; in a run that several processes
    /// share it returns true.
    ///
    /// # Errors
    /// [`RunsError`] if the policy is not finite, an episode fails, `go_on` returns false or a file
    /// cannot be written.
    pub fn finish<M: MakeEnvs>(
        &self,
        tasks: &M,
        trainer: &mut dyn Learner,
        folder: &RunFolder,
        num_threads: usize,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<Outcome, RunsError> {
        self.finish_while(tasks, trainer, folder, num_threads, &mut go_on)
    }

    fn finish_while<M: MakeEnvs>(
        &self,
        tasks: &M,
        trainer: &mut dyn Learner,
        folder: &RunFolder,
        num_threads: usize,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Outcome, RunsError> {
        let description = folder.description();
        let (env_id, config) = (description.env_id, description.config());
        let mut policy = trainer.any_policy(&env_id.to_string())?;
        let episodes = trainer.evaluation_episodes();
        let vec_config = VecConfig::default().with_num_threads(num_threads);
        let num_envs = episodes.min(FINAL_ENVS);
        let own = share(trainer.workers(), episodes);
        let own = match &mut policy {
            AnyPolicy::State(policy) => {
                let make = |config| tasks.make(config);
                let mut envs = make_vec_while(config, num_envs, vec_config, make, || true)?;
                evaluate_range(&mut envs, policy, own, FINAL_SEED, |_| (), go_on)
            }
            #[cfg(feature = "render")]
            AnyPolicy::Pixels(policy) => {
                let make = maker_with_pictures(maker(tasks, config), policy.sight().pixels.clone());
                let mut envs = vec_env((0..num_envs).map(|_| make()), vec_config)?;
                evaluate_range(&mut envs, &mut **policy, own, FINAL_SEED, |_| (), go_on)
            }
        }?;
        let summary = gather_episodes(trainer.workers(), &own)?.summary()?;
        let success = SuccessRate { rate: summary.success_rate, episodes, first_seed: FINAL_SEED };
        let policy = policy.with_success(success);
        let outcome = Outcome {
            env_id,
            seed: trainer.seed(),
            counters: *trainer.counters(),
            target: self.target.success_rate,
            reached: self.target.first_reached(trainer.rows()).map(|row| row.counters),
            success: Some(success),
            episode_return_mean: summary.episode_return_mean.value,
        };
        if trainer.workers().rank() == 0 {
            folder.write_policy(&policy)?;
            #[cfg(feature = "page")]
            folder.write_page(&page::html(tasks, description, trainer, policy)?)?;
        }
        Ok(outcome)
    }
}
