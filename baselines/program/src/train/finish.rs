//! Runs to their end, and what is said of them.

use std::{ops::ControlFlow, path::Path};

use anyhow::Context;
use baselines::{
    Estimate,
    learn::{CurveRow, SaveLearner, Target, Trainer, UpdateSeconds},
    runs::{Length, Outcome, Ready, RunFolder, RunPlan, TensorBoard},
    workers::gather_values,
};
use indicatif::ProgressBar;

use super::Args;
use crate::output::tell;
use crate::shared::{
    json::Metric,
    progress,
    signals::{Signals, Stopped},
    tasks::Tasks,
};

/// Says that nothing holds off other processes, if that is so.
pub fn tell_of_locks(path: &Path, is_shared: bool) {
    if is_shared {
        tell(format_args!(
            "train: {} is on a file system without locks: let no other process write there",
            path.display()
        ));
    }
}

/// Runs a trainer to its end, as [`finish`] does, and says how long its ranks have waited.
pub fn finish_trained<M: Tasks>(
    tasks: &M,
    args: &Args,
    ready: Ready<Trainer<M::Env>>,
    signals: &Signals,
) -> anyhow::Result<Outcome> {
    let Ready { mut trainer, folder, .. } = ready;
    let outcome = finish(tasks, args, &mut trainer, &folder, signals)?;
    let UpdateSeconds { total, exchanging, .. } = trainer.update_seconds();
    if exchanging > 0.0 && trainer.workers().rank() == 0 {
        say!("train: of {total:.1} s of updates, {exchanging:.1} s were spent in MPI")?;
    }
    Ok(outcome)
}

/// Runs a learner to its end, and writes its files. A signal ends it after a last checkpoint.
pub fn finish(
    tasks: &impl Tasks,
    args: &Args,
    trainer: &mut dyn SaveLearner,
    folder: &RunFolder,
    signals: &Signals,
) -> anyhow::Result<Outcome> {
    let plan = plan(args, folder);
    let is_first = trainer.workers().rank() == 0;
    tell_of_locks(folder.path(), folder.is_shared());
    let bar = progress::bar(usize::try_from(plan.length.end())?, "training");
    if is_first {
        bar.set_position(plan.length.reached(trainer.counters()));
    }
    let seed = format!("seed-{}", trainer.seed());
    let board = args.tensorboard.as_ref().filter(|_| is_first);
    let mut board = board.map(|folder| TensorBoard::create(folder.join(seed))).transpose()?;
    let mut drawn = Ok(());
    let put_off = signals.put_off();
    let mut watch = |_: &_, row: Option<&CurveRow>| {
        if let Some(row) = row.filter(|_| is_first) {
            show(&bar, plan.length, row);
            drawn = board.as_mut().map_or(Ok(()), |board| board.write(row));
        }
        let goes_on = signals.received() == 0 && drawn.is_ok();
        if goes_on { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    let trained = plan.run(trainer, Some(folder), &mut watch);
    drop(put_off);
    bar.finish_and_clear();
    trained?;
    drawn.context("--tensorboard: the curve cannot be written")?;
    // The signal of the first rank that has received one.
    let received = gather_values(trainer.workers(), &signals.received())?;
    if let Some(stopped) = received.into_iter().find_map(Stopped::by) {
        if is_first {
            let folder = folder.path().display().to_string();
            tell(format_args!(
                "train: {stopped} after {} steps: continue it with --resume {}",
                trainer.counters().steps,
                shlex::try_quote(&folder)?
            ));
        }
        return Err(stopped.into());
    }
    let outcome = plan.finish(tasks, trainer, folder, args.threads.get(), || true)?;
    if is_first {
        say!("train: {outcome}; wrote {}", folder.path().display())?;
    }
    Ok(outcome)
}

/// Returns the plan of a run, with what the flags change.
fn plan(args: &Args, folder: &RunFolder) -> RunPlan {
    let mut plan = RunPlan::of(folder.description());
    plan.between_checkpoints = args.checkpoint_seconds;
    if let (Length::Steps(end), Some(steps)) = (&mut plan.length, args.steps) {
        *end = steps;
    }
    if let Some(success_rate) = args.target {
        plan.target = Target { success_rate, ..plan.target };
    }
    plan
}

fn show(bar: &ProgressBar, length: Length, row: &CurveRow) {
    let CurveRow { counters, success_rate: Estimate { value, .. }, .. } = row;
    bar.set_position(length.reached(counters));
    bar.set_message(format!("success {value:.2}"));
    progress::note(
        bar,
        format_args!(
            "{:>9} steps {:>7} updates {:>8.2} s  success {value:.2}",
            counters.steps, counters.updates, counters.seconds
        ),
    );
}

/// Returns the numbers of runs for `--json`.
pub fn figures(outcomes: &[Outcome]) -> Vec<(String, Metric)> {
    let mut figures = Vec::new();
    for outcome in outcomes {
        let mut push = |name: &str, figure| {
            let Outcome { env_id, seed, .. } = outcome;
            figures.push((format!("train/{env_id}/seed-{seed}/{name}"), figure));
        };
        if let Some(reached) = outcome.reached {
            push("steps_to_target", Metric::new(reached.steps as f64, "1"));
            push("seconds_to_target", Metric::new(reached.seconds, "s"));
        }
        push("steps", Metric::new(outcome.counters.steps as f64, "1"));
        push("seconds", Metric::new(outcome.counters.seconds, "s"));
        if let Some(success) = outcome.success {
            push("success_rate", Metric::new(success.rate.value, "1"));
        }
        push("episode_return_mean", Metric::new(outcome.episode_return_mean, "1"));
    }
    figures
}
