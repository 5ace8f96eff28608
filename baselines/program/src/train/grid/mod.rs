//! `train --grid`: every choice of settings with every seed, one run per thread, one table and one
//! picture. A grid that was stopped or killed continues where it was.

mod heat_map;

use std::path::{Path, PathBuf};

use anyhow::Context;
use baselines::runs::{Grid, GridEvent, GridFolder, GridRun, GridTable, WatchGrid, run_grid};
use her_relabel::files::read_text;
use indicatif::ProgressBar;

use self::heat_map::heat_map;
use super::{Args, finish::tell_of_locks};
use crate::{
    figures::picture::Picture,
    output::tell,
    shared::{
        json::{Metric, write_results},
        progress,
        signals::{Signals, Stopped},
        tasks::Tasks,
    },
};

/// The largest size of a grid's file, in bytes.
const LIMIT: u64 = 1 << 20;

pub fn run(tasks: &impl Tasks, args: &Args, file: &Path) -> anyhow::Result<bool> {
    let of_file = || format!("--grid {}", file.display());
    let text = read_text(file, LIMIT).with_context(of_file)?;
    let grid = Grid::parse(&text).with_context(of_file)?;
    let env_id = grid.env_id().with_context(of_file)?;
    let preset = grid.preset().with_context(of_file)?.settings(env_id.task);
    let choices = grid.choices(&preset).with_context(of_file)?;
    let signals = Signals::listen()?;
    let path = args.out.clone().unwrap_or_else(|| {
        PathBuf::from("results/train").join(file.file_stem().unwrap_or(file.as_os_str()))
    });
    let folder = GridFolder::open(&path, &grid, &preset)?;
    tell_of_locks(&path, folder.is_shared());
    let runs = grid.runs(&choices, &folder)?;
    let put_off = signals.put_off();
    let shown = Shown::new(&runs, &signals)?;
    let ended = run_grid(tasks, &runs, args.threads.get(), args.checkpoint_seconds, &shown);
    drop(put_off);
    shown.bar.finish_and_clear();
    let ended = ended?;
    let (num_ended, total) = (ended.iter().flatten().count(), runs.len());
    if let Some(stopped) = Stopped::by(signals.received()) {
        tell(format_args!(
            "train: {stopped} after {num_ended} of {total} runs: the same command continues \
             from there"
        ));
        return Err(stopped.into());
    }
    let ended = runs.iter().zip(ended).filter_map(|(run, ended)| Some((run.choice, ended?)));
    let table = GridTable::new(&grid, &choices, &ended.collect::<Vec<_>>())?;
    let written = folder.write_table(&table)?;
    say!("{}", table.text())?;
    say!("wrote {}", written.display())?;
    let Picture { svg, png } = Picture::new(&heat_map(&grid, &table)?)?;
    for written in folder.write_picture(svg.as_bytes(), &png)? {
        say!("wrote {}", written.display())?;
    }
    write_results(args.json.as_ref(), &grid, figures(&table))?;
    Ok(true)
}

/// The bar of all runs, and the signals that stop them.
struct Shown<'a> {
    bar: ProgressBar,
    num_runs: usize,
    signals: &'a Signals,
}

impl<'a> Shown<'a> {
    fn new(runs: &[GridRun], signals: &'a Signals) -> anyhow::Result<Self> {
        let steps = runs.iter().map(|run| run.description.steps);
        let num_steps = steps.fold(0, u64::saturating_add);
        let bar = progress::bar(usize::try_from(num_steps)?, "training");
        bar.set_message(format!("0 of {} runs", runs.len()));
        Ok(Self { bar, num_runs: runs.len(), signals })
    }
}

impl WatchGrid for Shown<'_> {
    fn go_on(&self) -> bool {
        self.signals.received() == 0
    }

    fn further_steps(&self, count: u64) {
        self.bar.inc(count);
    }

    fn ended(&self, run: &GridRun, num_ended: usize, how: GridEvent<'_>) {
        let runs = format!("{num_ended} of {} runs", self.num_runs);
        let how = match how {
            GridEvent::EndedBefore => None,
            GridEvent::Ended(outcome) => {
                let parts = run.parts.iter().map(|part| format!("{part}, "));
                Some(parts.collect::<String>() + &outcome.to_string())
            }
            GridEvent::Diverged(error) => Some(format!("{}: {error:?}", run.path.display())),
        };
        if let Some(how) = how {
            progress::note(&self.bar, format_args!("{runs}: {how}"));
        }
        self.bar.set_message(runs);
    }
}

/// Returns what `--json` writes.
fn figures(table: &GridTable) -> impl Iterator<Item = (String, Metric)> {
    table.rows().iter().flat_map(|row| {
        let named = |name: &str, value: f64, unit| {
            (format!("train/grid/{}/{name}", row.name), Metric::new(value, unit))
        };
        let steps = row.steps.map(|steps| named("steps_to_target", steps.value, "1"));
        let seconds = row.seconds.map(|seconds| named("seconds_to_target", seconds.value, "s"));
        let success = named("success_rate", row.success.value, "1");
        let reached = named("reached", row.num_reached as f64, "1");
        [success, reached].into_iter().chain(steps).chain(seconds)
    })
}
