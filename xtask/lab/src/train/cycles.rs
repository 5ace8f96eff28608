//! Training, cycle by cycle, until a run or its process is to end.

use std::time::Instant;

use anyhow::Context;
use baselines::{
    Estimate,
    learn::{CurveRow, Target, Trainer},
    workers::{Workers, gather_values, sum},
};
use fetch_env::MujocoEnv;
use indicatif::ProgressBar;

use super::{Args, files::RunFiles};
use crate::shared::{progress, signals::Signals};

/// Trains to the end of a run, or to that of the cycle in which a rank receives a signal.
pub fn train(
    args: &Args,
    trainer: &mut Trainer<MujocoEnv>,
    files: &RunFiles,
    signals: &Signals,
    num_steps: u64,
    target: Target,
) -> anyhow::Result<()> {
    let bar = progress::bar(usize::try_from(num_steps)?, "training");
    let is_first = trainer.workers().rank() == 0;
    if is_first {
        bar.set_position(trainer.counters().steps);
        files.write_curve(trainer.rows())?;
    }
    let mut saved = Instant::now();
    let mut signal = 0;
    while signal == 0 && trainer.counters().steps < num_steps && !target.is_reached(trainer.rows())
    {
        if let Some(row) = trainer.run_cycle(num_steps)? {
            let mut written = Ok(());
            if is_first {
                show(&bar, &row);
                written = files.write_curve(trainer.rows());
            }
            let is_due = saved.elapsed().as_secs_f64() >= args.checkpoint_seconds;
            let saves = is_first && is_due && written.is_ok();
            if sum(trainer.workers(), u64::from(saves))? > 0 {
                trainer.save(&files.folder).context("the run stops here")?;
                saved = Instant::now();
            }
            written?;
        }
        signal = first_signal(signals, trainer.workers())?;
    }
    bar.finish_and_clear();
    Ok(())
}

/// Returns the signal of the first rank that has received one; 0 for none.
pub fn first_signal(signals: &Signals, workers: &mut dyn Workers) -> anyhow::Result<usize> {
    let all = gather_values(workers, &signals.received())?;
    Ok(all.into_iter().find(|signal| *signal != 0).unwrap_or(0))
}

fn show(bar: &ProgressBar, row: &CurveRow) {
    let CurveRow { counters, success_rate: Estimate { value, .. }, .. } = row;
    bar.set_position(counters.steps);
    bar.set_message(format!("success {value:.2}"));
    progress::note(
        bar,
        format_args!(
            "{:>9} steps {:>7} updates {:>8.2} s  success {value:.2}",
            counters.steps, counters.updates, counters.seconds
        ),
    );
}
