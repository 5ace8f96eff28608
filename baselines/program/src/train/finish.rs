//! Taking a run to its end, and writing its files.

use std::time::Instant;

use anyhow::Context;
use baselines::{
    SuccessRate, TrainedPolicy, evaluate_across_workers,
    learn::{Counters, CurveRow, Target, TrainError, Trainer},
    workers::{Workers, gather_values, sum},
};
use fetch_env::{EnvId, MujocoEnv, make_vec, vec_env::VecConfig};

use super::{
    files::{Outcome, RunFiles},
    page,
};
use crate::shared::{choice::ModelChoice, signals::Signals};

/// The length of a run.
#[derive(Clone, Copy, Debug)]
pub enum Length {
    /// Environment steps.
    Steps(u64),
    /// Updates from demonstrations alone, without environment steps.
    Updates(u64),
}

impl Length {
    /// Returns the number at which the run ends.
    pub const fn end(self) -> u64 {
        let (Self::Steps(end) | Self::Updates(end)) = self;
        end
    }

    /// Returns how far a run has got.
    pub const fn reached(self, counters: &Counters) -> u64 {
        match self {
            Self::Steps(_) => counters.steps,
            Self::Updates(_) => counters.updates,
        }
    }

    /// Continues to the next point at which a run can stop. Returns a row if it was evaluated.
    fn go_on(self, trainer: &mut Trainer<MujocoEnv>) -> Result<Option<CurveRow>, TrainError> {
        match self {
            Self::Steps(end) => trainer.run_cycle(end),
            Self::Updates(end) => {
                let interval = end.div_ceil(OFFLINE_EVALUATIONS);
                let done = trainer.counters().updates;
                trainer.update((interval - done % interval).min(end - done))?;
                trainer.evaluate().map(Some)
            }
        }
    }
}

/// The number of evaluations of a run that learns from demonstrations alone.
const OFFLINE_EVALUATIONS: u64 = 10;

/// Where a run ends, and how it gets there.
pub struct Course {
    pub length: Length,
    pub target: Target,
    pub threads: usize,
    /// The minimum number of seconds between two checkpoints.
    pub checkpoint_seconds: f64,
}

/// Trains to the end of a run, or of the cycle in which a rank receives a signal, and saves a last
/// checkpoint. The first rank calls `watch` after each evaluation.
pub fn train(
    trainer: &mut Trainer<MujocoEnv>,
    files: &RunFiles,
    course: &Course,
    signals: &Signals,
    watch: impl FnMut(&CurveRow),
) -> anyhow::Result<()> {
    run_cycles(trainer, files, course, signals, watch)?;
    trainer.save(&files.folder)?;
    Ok(())
}

fn run_cycles(
    trainer: &mut Trainer<MujocoEnv>,
    files: &RunFiles,
    course: &Course,
    signals: &Signals,
    mut watch: impl FnMut(&CurveRow),
) -> anyhow::Result<()> {
    let &Course { length, target, checkpoint_seconds, .. } = course;
    let is_first = trainer.workers().rank() == 0;
    if is_first {
        files.write_curve(trainer.rows())?;
    }
    let mut saved = Instant::now();
    let mut signal = 0;
    let is_over = |trainer: &Trainer<_>| {
        length.reached(trainer.counters()) >= length.end() || target.is_reached(trainer.rows())
    };
    while signal == 0 && !is_over(trainer) {
        if let Some(row) = length.go_on(trainer)? {
            let mut written = Ok(());
            if is_first {
                watch(&row);
                written = files.write_curve(trainer.rows());
            }
            let is_due = saved.elapsed().as_secs_f64() >= checkpoint_seconds;
            let saves = is_first && is_due && written.is_ok();
            if sum(trainer.workers(), u64::from(saves))? > 0 {
                trainer.save(&files.folder).context("the run stops here")?;
                saved = Instant::now();
            }
            written?;
        }
        signal = first_signal(signals, trainer.workers())?;
    }
    Ok(())
}

/// Returns the signal of the first rank that has received one; 0 for none.
pub fn first_signal(signals: &Signals, workers: &mut dyn Workers) -> anyhow::Result<usize> {
    let all = gather_values(workers, &signals.received())?;
    Ok(all.into_iter().find(|signal| *signal != 0).unwrap_or(0))
}

/// The first seed of the final evaluation, whose seeds no training and no other evaluation uses.
const FINAL_SEED: u64 = 1 << 50;
/// The number of environments that it steps together.
const FINAL_ENVS: usize = 20;

/// Measures the policy of a run that has ended, and writes the policy and the page.
pub fn finish(
    trainer: &mut Trainer<MujocoEnv>,
    files: &RunFiles,
    course: &Course,
) -> anyhow::Result<Outcome> {
    let (env_id, model, target) = (files.run.env_id()?, files.run.model, course.target);
    let policy = trainer.policy(&env_id.to_string())?;
    let episodes = trainer.settings().schedule.evaluation_episodes;
    let measured = measured(trainer.workers(), policy, episodes, env_id, model, course.threads)?;
    let (policy, episode_return_mean) = measured;
    let reached = trainer.rows().windows(2).position(|rows| target.is_reached(rows));
    let outcome = Outcome {
        env_id: env_id.to_string(),
        seed: trainer.seed(),
        counters: *trainer.counters(),
        target: target.success_rate,
        reached: reached.map(|first| trainer.rows()[first + 1].counters),
        success: policy.header().success,
        episode_return_mean,
    };
    if trainer.workers().rank() == 0 {
        files.write_policy(&policy)?;
        let settings = trainer.settings();
        files.write_page(&page::html(env_id, model, trainer.rows(), settings, policy)?)?;
    }
    Ok(outcome)
}

/// Measures the success rate of a policy on seeds that no training has seen, and its mean return.
fn measured(
    workers: &mut dyn Workers,
    mut policy: TrainedPolicy,
    episodes: usize,
    env_id: EnvId,
    model: ModelChoice,
    threads: usize,
) -> anyhow::Result<(TrainedPolicy, f64)> {
    let config = env_id.config().with_model(model.source());
    let vec_config = VecConfig::default().with_num_threads(threads);
    let mut envs = make_vec(config, episodes.min(FINAL_ENVS), vec_config)?;
    let evaluation =
        evaluate_across_workers(workers, &mut envs, &mut policy, episodes, FINAL_SEED, |_| ())?;
    let summary = evaluation.summary()?;
    let rate = summary.success_rate;
    let success = SuccessRate { rate, episodes, first_seed: FINAL_SEED };
    Ok((policy.with_success(success), summary.episode_return_mean.value))
}
