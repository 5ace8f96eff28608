//! Episodes of a policy on all threads: the flags that describe them, and running them.

use std::{num::NonZeroUsize, thread::available_parallelism};

use anyhow::ensure;
use baselines::{Episode, Evaluation, RandomPolicy, evaluate};
use fetch_env::variation::VariationError;
use fetch_env::{AddRenderObservation, Env, EnvExt, EnvId, FetchConfig, MakeError};
use indicatif::ProgressBar;
use rayon::{ThreadPool, ThreadPoolBuilder, prelude::*};
use serde::Serialize;

use super::choice::{ModelChoice, acting, pixel_policy_of, policy_of};
use super::tasks::Tasks;
use crate::output::usage;

/// The most threads of a command, as of a vector of environments.
const MAX_THREADS: usize = 1024;

/// The flags of commands that run episodes.
#[derive(Clone, Debug, clap::Args, Serialize)]
pub struct EpisodeArgs {
    /// Number of episodes of each evaluation
    #[arg(long, default_value = "100")]
    pub episodes: NonZeroUsize,
    /// Seed of the first episode; the others have the seeds that follow
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of threads; results do not depend on it
    #[arg(long)]
    #[arg(default_value_t = available_parallelism().unwrap_or(NonZeroUsize::MIN))]
    #[serde(skip)]
    threads: NonZeroUsize,
    /// Model of the robot
    #[arg(long, value_enum, default_value_t = ModelChoice::Builtin)]
    model: ModelChoice,
}

impl EpisodeArgs {
    /// Starts the threads: no more than there are episodes.
    pub fn threads(&self) -> anyhow::Result<ThreadPool> {
        let threads = self.threads.min(self.episodes).get();
        ensure!(
            threads <= MAX_THREADS,
            "{threads} threads are too many: use at most {MAX_THREADS}"
        );
        Ok(ThreadPoolBuilder::new().num_threads(threads).build()?)
    }

    /// Returns these flags with `factor` times as many episodes.
    pub fn times(&self, factor: NonZeroUsize) -> Self {
        Self { episodes: self.episodes.saturating_mul(factor), ..self.clone() }
    }

    /// Returns the reference's settings of an environment, with the model that the flags name.
    pub fn config(&self, env_id: EnvId) -> FetchConfig {
        env_id.config().with_model(self.model.source())
    }

    /// Runs the episodes on all threads, each with its own environment and policy.
    pub fn evaluate(
        &self,
        tasks: &impl Tasks,
        config: &FetchConfig,
        policy: &str,
        threads: &ThreadPool,
        bar: &ProgressBar,
    ) -> anyhow::Result<Evaluation> {
        let seeds: Vec<u64> = (0..self.episodes.get() as u64)
            .map(|episode| self.seed.wrapping_add(episode))
            .collect();
        let size = seeds.len().div_ceil(threads.current_num_threads());
        let parts: Vec<Vec<Episode>> = threads.install(|| {
            let parts = seeds.par_chunks(size);
            parts
                .map(|seeds| self.run(tasks, config, policy, seeds, bar))
                .collect::<anyhow::Result<_>>()
        })?;
        Ok(Evaluation { episodes: parts.concat() })
    }

    /// Runs an episode for each of these seeds.
    fn run(
        &self,
        tasks: &impl Tasks,
        config: &FetchConfig,
        policy_name: &str,
        seeds: &[u64],
        bar: &ProgressBar,
    ) -> anyhow::Result<Vec<Episode>> {
        let mut env = tasks.make(config.clone())?;
        let mut episodes = Vec::new();
        if let Some(mut policy) = pixel_policy_of(policy_name, config.task())? {
            let pictures = AddRenderObservation::new(policy.sight().pixels.clone());
            let mut env = env.wrap(pictures)?;
            for &seed in seeds {
                episodes.extend(evaluate(&mut env, &mut policy, 1, seed, |_| bar.inc(1))?.episodes);
            }
            return Ok(episodes);
        }
        let mut policy = policy_of(policy_name, &env, self.seed)?;
        for &seed in seeds {
            let mut random = RandomPolicy::new(env.action_space(), seed);
            let policy = acting(policy_name, &mut random, &mut *policy);
            episodes.extend(evaluate(&mut env, policy, 1, seed, |_| bar.inc(1))?.episodes);
        }
        Ok(episodes)
    }
}

/// Checks that the environment has the factors that its settings vary. If not, the usage is wrong.
pub fn check_variation(tasks: &impl Tasks, config: &FetchConfig) -> anyhow::Result<()> {
    let mut env = match tasks.make(config.clone()) {
        Err(MakeError::Variation(error)) => return Err(usage(error)),
        made => made?,
    };
    // The first reset finds factors that no task has.
    match env.reset(Some(0)) {
        Err(error) if error.downcast_ref::<VariationError>().is_some() => Err(usage(error)),
        reset => Ok(reset.map(drop)?),
    }
}
