//! `train --grid`: every choice of settings with every seed, one run per thread, one table and one
//! picture. A grid that was stopped or killed continues where it was.

mod description;
mod error;
mod folder;
mod heat_map;
mod running;
mod table;

use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use crate::output::tell;
use anyhow::Context;
use baselines::learn::limits;
use her_relabel::files::read_text;

use self::{
    description::Grid,
    folder::{Begun, GridFolder, TABLE},
    heat_map::HeatMap,
    running::{Planned, run_all},
    table::Table,
};
use super::Args;
use crate::{
    figures::picture::Picture,
    shared::{
        json::write_results,
        signals::{Signals, Stopped},
    },
};

pub use self::error::GridError;

/// The largest size of a grid's file, in bytes.
const LIMIT: u64 = 1 << 20;

pub fn run(args: &Args, file: &Path) -> anyhow::Result<bool> {
    let of_file = || format!("--grid {}", file.display());
    let text = read_text(file, LIMIT).with_context(of_file)?;
    let grid = Grid::parse(&text).with_context(of_file)?;
    let env_id = grid.env_id().with_context(of_file)?;
    let preset_name = grid.preset().with_context(of_file)?;
    let preset = preset_name.settings(env_id.task);
    let choices = grid.choices(&preset).with_context(of_file)?;
    let signals = Signals::listen()?;
    let path = args.out.clone().unwrap_or_else(|| {
        PathBuf::from("results/train").join(file.file_stem().unwrap_or(file.as_os_str()))
    });
    let folder = GridFolder::open(&path, &Begun { grid: grid.clone(), preset })?;
    let (default_steps, default_target) = limits(env_id.task);
    let num_steps = grid.steps.unwrap_or(default_steps);
    let target = grid.target.unwrap_or(default_target);
    let mut planned = Vec::new();
    for (number, choice) in choices.iter().enumerate() {
        for &seed in &grid.seeds {
            let out = folder.run(&choice.file_name(), seed);
            planned.push(Planned {
                choice: number,
                settings: choice.settings.clone(),
                name: choice.parts.iter().map(|part| format!("{part}, ")).collect(),
                args: Args {
                    env_id,
                    preset: preset_name,
                    seed,
                    steps: Some(num_steps),
                    target: Some(target),
                    set: choice.assignments.clone(),
                    threads: NonZeroUsize::MIN,
                    out: Some(out.clone()),
                    ..args.clone()
                },
                folder: out,
            });
        }
    }
    signals.put_off();
    let ended = run_all(&planned, num_steps, args.threads.get(), &signals)?;
    signals.end_at_once();
    let (num_ended, total) = (ended.iter().flatten().count(), planned.len());
    if let Some(stopped) = Stopped::by(signals.received()) {
        tell(format_args!(
            "train: {stopped} after {num_ended} of {total} runs: the same command continues \
             from there"
        ));
        return Err(stopped.into());
    }
    let ended = planned.iter().zip(ended).filter_map(|(run, ended)| Some((run.choice, ended?)));
    let table = Table::new(&grid, &choices, &ended.collect::<Vec<_>>())?;
    folder.write_table(&table.csv()?)?;
    say!("{}", table.text())?;
    say!("wrote {}", path.join(TABLE).display())?;
    folder.write_picture(&Picture::new(&HeatMap::new(&grid, &table, target)?)?)?;
    write_results(args.json.as_ref(), &grid, table.figures())?;
    Ok(true)
}
