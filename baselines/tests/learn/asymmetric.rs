//! An actor that sees pictures and learns from a critic that sees the state. Without OpenGL, there is
//! nothing to test, unless `MUJOCO_GL` demands it.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use baselines::learn::{
    AlgorithmSettings, CheckpointError, CurveRow, SacSettings, TrainError, TrainSettings, Trainer,
};
use baselines::{Sight, TrainedPolicyError, evaluate};
use fetch_env::{Camera, EnvError, FreeCamera, Task};
use tempfile::tempdir;
use testing::unless_blind;
use zip::CompressionMethod;

use crate::damaged_checkpoints;
use crate::runs::{self, Result};
use crate::seeing::{self, PixelEnv, maker};

const ID: &str = "FetchReachDense-v4";

fn sight() -> Sight {
    seeing::sight(32)
}

fn make() -> Result<PixelEnv, EnvError> {
    maker(ID, &sight())()
}

fn settings() -> TrainSettings {
    let mut settings = TrainSettings::fast(Task::Reach).with_pixels(Task::Reach);
    settings.schedule.evaluation_interval = Some(100_000);
    settings.schedule.evaluation_episodes = 4;
    let actor = settings.pixels.get_or_insert_default();
    (actor.pixel_hidden, actor.pixel_batch_size) = (vec![64], 32);
    settings
}

fn trainer(settings: TrainSettings, num_threads: usize) -> Result<Trainer<PixelEnv>, TrainError> {
    Trainer::with_pixels(make, &sight(), settings, 0, num_threads)
}

fn resume(folder: &Path, num_threads: usize) -> Result<Trainer<PixelEnv>, CheckpointError> {
    Trainer::resume_pixels(make, &sight(), folder, num_threads)
}

#[test]
fn it_learns_to_reach_from_pictures_alone() -> Result {
    if unless_blind(make())?.is_none() {
        return Ok(());
    }
    let mut trainer = trainer(settings(), 2)?;
    trainer.run(2_400, None, |_, _| ControlFlow::Continue(()))?;
    // The policy is what was evaluated.
    let mut policy = trainer.pixel_policy(ID)?;
    let result = evaluate(&mut make()?, &mut policy, 20, 1 << 45, |_| ())?;
    let success = result.summary()?.success_rate.value;
    // The first weights reach less than a tenth of the goals.
    assert!(success >= 0.4, "{success}");
    assert_eq!(policy.sight(), &sight());
    Ok(())
}

#[test]
fn a_stopped_run_ends_with_the_same_bits_on_any_number_of_threads() -> Result {
    if unless_blind(make())?.is_none() {
        return Ok(());
    }
    let mut settings = settings();
    settings.schedule.evaluation_interval = Some(200);
    // The memory is full after half of the steps.
    settings.pixels.get_or_insert_default().pixel_capacity = 250;
    const STEPS: u64 = 600;
    let mut whole = trainer(settings.clone(), 2)?;
    whole.run(STEPS, None, |_, _| ControlFlow::Continue(()))?;

    let folder = tempdir()?;
    trainer(settings, 1)?.save(&folder)?;
    let (mut trainer, mut saves) = (resume(folder.path(), 1)?, 0);
    while !trainer.is_over(STEPS, None) {
        // Also in the middle of updates and evaluations.
        let mut calls = 0;
        trainer.run_cycle_while(STEPS, || {
            calls += 1;
            saves % 2 == 0 || calls < 2
        })?;
        trainer.save(&folder)?;
        saves += 1;
        trainer = resume(folder.path(), 1 + saves % 2)?;
        // What was read is what is written again, before the next step.
        trainer.save(&folder)?;
        trainer = resume(folder.path(), 1)?;
    }
    assert!(saves > whole.rows().len(), "{saves}");
    assert_eq!(trainer.pixel_policy(ID)?, whole.pixel_policy(ID)?);
    assert_eq!(trainer.policy(ID)?, whole.policy(ID)?);
    let rows = |trainer: &Trainer<_>| -> Vec<_> {
        let row = |row: &CurveRow| (row.success_rate, row.losses, row.diagnostics.clone());
        trainer.rows().iter().map(row).collect()
    };
    assert_eq!(rows(&trainer), rows(&whole));
    assert_eq!(whole.rows().len(), 3);
    assert_eq!(trainer.settings(), whole.settings());
    Ok(())
}

#[test]
fn a_checkpoint_is_continued_with_the_same_sight_alone() -> Result {
    if unless_blind(make())?.is_none() {
        return Ok(());
    }
    let folder = tempdir()?;
    let mut seeing_run = trainer(settings(), 1)?;
    seeing_run.cycle()?;
    seeing_run.save(&folder)?;
    let far = sight().with_view(|view| view.with_camera(Camera::Free(FreeCamera::REFERENCE)));
    let mut blind = sight();
    blind.fields.clear();
    for other in [seeing::sight(24), far, blind] {
        let error = Trainer::resume_pixels(maker(ID, &other), &other, &folder, 1).unwrap_err();
        assert!(matches!(error, CheckpointError::OtherSight { .. }), "{error}");
        assert!(error.to_string().contains("sees 32 x 32 pixels without the goal"), "{error}");
    }
    let error = Trainer::resume(make, &folder, 1).unwrap_err();
    assert!(matches!(error, CheckpointError::OtherSight { .. }), "{error}");
    let other = tempdir()?;
    Trainer::new(make, TrainSettings::fast(Task::Reach), 0, 1)?.save(&other)?;
    let error = resume(other.path(), 1).unwrap_err();
    assert!(error.to_string().contains("sees no pictures"), "{error}");

    // An archive that is cut in the memory.
    let path = seeing_run.save(&folder)?;
    let entries = damaged_checkpoints::entries(&path)?;
    let cut = entries.into_iter().map(|(name, mut bytes)| {
        bytes.truncate(bytes.len() - usize::from(name == "frames.bytes"));
        (name, bytes)
    });
    fs::remove_file(&path)?;
    damaged_checkpoints::write(&path, &cut.collect::<Vec<_>>(), CompressionMethod::Stored)?;
    let error = resume(folder.path(), 1).unwrap_err();
    assert!(matches!(error, CheckpointError::Damaged { .. }), "{error}");
    assert!(error.to_string().contains("states of another length"), "{error}");
    Ok(())
}

#[test]
fn what_cannot_learn_from_pictures_is_refused() -> Result {
    let error = Trainer::new(runs::make, settings(), 0, 1).unwrap_err();
    assert!(matches!(error, TrainError::Setting { name: "pixels", .. }), "{error}");
    let error = settings().with("critic_updates=0").unwrap_err();
    assert!(error.to_string().contains("critic_updates is 0"), "{error}");
    if unless_blind(make())?.is_none() {
        return Ok(());
    }
    let mut sac = settings();
    sac.algorithm = AlgorithmSettings::Sac(SacSettings::default());
    let error = trainer(sac, 1).unwrap_err();
    assert!(matches!(&error, TrainError::NoCritic { algorithm } if algorithm == "sac"), "{error}");
    let mut beyond = sight();
    beyond.fields[0].range = 8..11;
    let error = Trainer::with_pixels(make, &beyond, settings(), 0, 1).unwrap_err();
    assert!(matches!(error, TrainError::Setting { name: "fields", .. }), "{error}");
    let shown = sight().with_view(|view| view.with_goals_shown(true));
    let error = Trainer::with_pixels(maker(ID, &shown), &shown, settings(), 0, 1).unwrap_err();
    assert!(matches!(error, TrainError::GoalShown), "{error}");
    let state = Trainer::new(make, TrainSettings::fast(Task::Reach), 0, 1)?;
    assert!(matches!(state.pixel_policy(ID), Err(TrainedPolicyError::Sight { .. })));
    Ok(())
}
