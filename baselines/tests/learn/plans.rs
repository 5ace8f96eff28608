//! The loop of a run in its folder: where it ends, what stops it, and what it leaves.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use baselines::learn::{CurveRow, Preset, Target, Trainer, checkpoints};
use baselines::runs::{Length, RunDescription, RunFolder, RunPlan, Watch, curve_csv};
use tempfile::tempdir;

use crate::ranks::on_ranks;
use crate::runs::{Kinematic, Outcome, Result, ddpg, make, outcome, settings};

const STEPS: u64 = 600;

/// A plan without a target that saves a checkpoint after each cycle.
fn plan(steps: u64) -> RunPlan {
    RunPlan {
        length: Length::Steps(steps),
        target: Target { success_rate: 2.0, evaluations: 2 },
        between_checkpoints: Duration::ZERO,
    }
}

fn folder(path: &Path) -> Result<RunFolder> {
    let description = RunDescription::new("FetchReach-v4".parse()?, Preset::Fast, 5);
    Ok(RunFolder::create(path, description, false)?)
}

fn trainer() -> Result<Trainer<Kinematic>> {
    Ok(Trainer::new(make, settings(ddpg()), 5, 1)?)
}

fn whole() -> Result<Outcome> {
    let mut trainer = trainer()?;
    trainer.run(STEPS, None, |_, _| ControlFlow::Continue(()))?;
    outcome(&trainer)
}

/// Stops a run at a question, in the middle of a cycle.
struct Impatient {
    questions: u32,
}

impl Watch<Trainer<Kinematic>> for Impatient {
    fn go_on(&mut self) -> bool {
        self.questions = self.questions.saturating_sub(1);
        self.questions > 0
    }

    fn cycle(&mut self, _: &Trainer<Kinematic>, _: Option<&CurveRow>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

#[test]
fn a_run_that_is_stopped_anywhere_ends_with_the_same_bits() -> Result {
    let temporary = tempdir()?;
    let folder = folder(temporary.path())?;
    trainer()?.save(folder.path())?;
    let mut stops = 0;
    for questions in [2, 30, 5, 100].into_iter().cycle() {
        let mut trainer = Trainer::resume(make, folder.path(), 1)?;
        plan(STEPS).run(&mut trainer, Some(&folder), &mut Impatient { questions })?;
        if plan(STEPS).is_over(&trainer) {
            assert!(outcome(&trainer)? == whole()?);
            break;
        }
        stops += 1;
    }
    assert!(stops > 4, "{stops}");
    Ok(())
}

#[test]
fn who_watches_sees_each_cycle_and_the_files_and_stops_the_run() -> Result {
    let temporary = tempdir()?;
    let (folder, mut trainer) = (folder(temporary.path())?, trainer()?);
    let (mut cycles, mut rows) = (0, 0);
    let mut watch = |trainer: &Trainer<Kinematic>, row: Option<&CurveRow>| {
        cycles += 1;
        if row.is_some() {
            rows += 1;
            let curve = folder.read_curve().expect("it is written before");
            assert_eq!(curve.len(), rows);
            assert_eq!(curve.last().map(|line| line.steps), Some(trainer.counters().steps));
        }
        if rows == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    plan(100_000).run(&mut trainer, Some(&folder), &mut watch)?;
    assert!(rows == 2 && cycles > 2, "{rows} rows, {cycles} cycles");
    let steps = trainer.counters().steps;
    let last = checkpoints(folder.path())?.pop().ok_or("no checkpoint")?;
    assert!(last.ends_with(format!("checkpoint-{steps:012}.zip")), "{last:?}");
    let csv = fs::read_to_string(folder.path().join("curve.csv"))?;
    assert!(csv.as_bytes() == curve_csv(trainer.rows())?);
    let diagnostics = &trainer.rows()[1].diagnostics;
    let [header, _, line] = csv.lines().collect::<Vec<_>>()[..] else { panic!("{csv}") };
    let cells: Vec<_> = header.split(',').zip(line.split(',')).collect();
    for (name, value) in diagnostics {
        assert!(cells.contains(&(name, &value.to_string())), "{name} {value}: {cells:?}");
    }
    assert!(!folder.path().join("policy.safetensors").exists(), "it has not ended");
    Ok(())
}

#[test]
fn a_run_ends_at_its_target_and_without_a_folder_writes_nothing() -> Result {
    let mut trainer = trainer()?;
    let target = Target { success_rate: 0.0, evaluations: 2 };
    let plan = RunPlan { target, ..plan(100_000) };
    plan.run(&mut trainer, None, &mut |_: &_, _: Option<&_>| ControlFlow::Continue(()))?;
    assert_eq!(trainer.rows().len(), 2);
    assert!(plan.is_over(&trainer) && target.is_reached(trainer.rows()));
    assert_eq!(target.first_reached(trainer.rows()), trainer.rows().last());
    Ok(())
}

#[test]
fn a_target_is_reached_first_where_the_evaluations_in_a_row_end() -> Result {
    let mut trainer = trainer()?;
    trainer.run(STEPS, None, |_, _| ControlFlow::Continue(()))?;
    let row = trainer.rows().last().cloned().ok_or("no row")?;
    let rows = [0.5, 1.0, 0.5, 0.9, 0.9, 0.9].map(|rate| {
        let mut row = row.clone();
        row.success_rate.value = rate;
        row.counters.updates = 0;
        row
    });
    let position = |evaluations| {
        let first = Target { success_rate: 0.9, evaluations }.first_reached(&rows);
        first.and_then(|first| rows.iter().position(|row| std::ptr::eq(row, first)))
    };
    assert_eq!([1, 2, 3, 4].map(position), [Some(1), Some(4), Some(5), None]);
    Ok(())
}

/// The rank that writes is not the one that stops the run.
#[test]
fn any_rank_stops_a_run_of_all() -> Result {
    let temporary = tempdir()?;
    let path = temporary.path();
    drop(folder(path)?);
    let ends = on_ranks(2, |workers| {
        let rank = workers.rank();
        let trainer = Trainer::with_workers(make, settings(ddpg()), 5, 1, workers);
        let mut trainer = trainer.expect("the ranks agree");
        let folder = if rank == 0 { folder(path).ok() } else { RunFolder::open(path).ok() };
        let mut watch = |trainer: &Trainer<Kinematic>, _: Option<&CurveRow>| {
            let stops = rank == 1 && trainer.counters().steps >= 200;
            if stops { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        plan(100_000).run(&mut trainer, folder.as_ref(), &mut watch).expect("it is written");
        trainer.counters().steps
    });
    assert_eq!(ends, [200, 200]);
    assert!(path.join("checkpoint-000000000200.zip").exists());
    Ok(())
}
