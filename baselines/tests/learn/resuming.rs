//! Checkpoints: a resumed run ends with the same bits, and a damaged checkpoint is refused.

use std::fs;
use std::ops::ControlFlow;

use baselines::learn::{CheckpointError, Trainer};
use fetch_env::make_kinematic;
use tempfile::tempdir;

use crate::damaged_checkpoints::entries;
use crate::runs::{Kinematic, Result, all_on, ddpg, make, outcome, ppo, sac, settings};

const STEPS: u64 = 1_000;

/// A run that is saved at each evaluation.
fn run(trainer: &mut Trainer<Kinematic>, folder: &std::path::Path) -> Result {
    let mut saved = Ok(());
    trainer.run(STEPS, None, |trainer, _| {
        saved = trainer.save(folder).map(|_| ());
        ControlFlow::Continue(())
    })?;
    Ok(saved?)
}

#[test]
fn a_resumed_run_ends_with_the_same_bits() -> Result {
    for algorithm in [ddpg(), sac(), ppo()] {
        let folder = tempdir()?;
        let mut settings = all_on(algorithm);
        // Episodes are under way, random and still ones among them, when checkpoints are saved.
        settings.schedule.steps_per_cycle = 30;
        if settings.replay.future_k > 0.0 {
            settings.exploration.random_episode_share = 0.3;
        }
        let mut whole = Trainer::new(make, settings.clone(), 5, 2)?;
        run(&mut whole, tempdir()?.path())?;

        let mut stopped = Trainer::new(make, settings, 5, 1)?;
        stopped.save(folder.path())?;
        let mut stopped = Trainer::resume(make, folder.path(), 1)?;
        stopped.run(STEPS / 2, None, |_, _| ControlFlow::Continue(()))?;
        stopped.save(folder.path())?;
        // What happens after the checkpoint is lost.
        stopped.cycle()?;
        drop(stopped);
        let mut resumed = Trainer::resume(make, folder.path(), 2)?;
        run(&mut resumed, folder.path())?;
        assert!(outcome(&resumed)? == outcome(&whole)?);
    }
    Ok(())
}

#[test]
fn a_run_that_is_stopped_in_the_middle_of_its_cycles_ends_with_the_same_bits() -> Result {
    for algorithm in [ddpg(), sac()] {
        let folder = tempdir()?;
        let settings = all_on(algorithm);
        let mut whole = Trainer::new(make, settings.clone(), 5, 1)?;
        whole.run(STEPS / 2, None, |_, _| ControlFlow::Continue(()))?;

        let mut trainer = Trainer::new(make, settings, 5, 1)?;
        let (mut in_updates, mut in_evaluations) = (0, 0);
        // The question at which a call stops: a cycle has two questions for its 20 updates, and
        // then those of an evaluation if one is due.
        for last in [1, 3, 20, u32::MAX].into_iter().cycle() {
            if trainer.is_over(STEPS / 2, None) {
                break;
            }
            let mut questions = 0;
            let row = trainer.run_cycle_while(STEPS / 2, || {
                questions += 1;
                questions < last
            })?;
            if questions == last {
                assert!(row.is_none());
                in_updates += u32::from(last == 1);
                in_evaluations += u32::from(last > 1);
                trainer.save(folder.path())?;
                trainer = Trainer::resume(make, folder.path(), 1)?;
            }
        }
        assert!(in_updates > 0 && in_evaluations > 0, "{in_updates}, {in_evaluations}");
        assert!(outcome(&trainer)? == outcome(&whole)?);
    }
    Ok(())
}

#[test]
fn a_run_that_is_saved_again_before_it_goes_on_has_the_same_checkpoint() -> Result {
    for algorithm in [ddpg(), sac(), ppo()] {
        let folder = tempdir()?;
        let mut settings = settings(algorithm);
        // Checkpoints are saved in the middle of episodes, at their ends, and after the next reset.
        settings.schedule.steps_per_cycle = 25;
        let mut trainer = Trainer::new(make, settings, 5, 1)?;
        for _ in 0..4 {
            trainer.cycle()?;
            let before = entries(&trainer.save(folder.path())?)?;
            let after = entries(&Trainer::resume(make, folder.path(), 1)?.save(folder.path())?)?;
            for (before, after) in before.iter().zip(&after) {
                assert!(before == after, "{}", before.0);
            }
            assert_eq!(before.len(), after.len());
        }
    }
    Ok(())
}

#[test]
fn two_checkpoints_stay_and_damaged_ones_are_refused() -> Result {
    let folder = tempdir()?;
    let mut trainer = Trainer::new(make, settings(ddpg()), 1, 1)?;
    assert!(matches!(Trainer::resume(make, folder.path(), 1), Err(CheckpointError::None { .. })));
    run(&mut trainer, folder.path())?;
    let mut paths: Vec<_> =
        fs::read_dir(folder.path())?.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    paths.sort();
    assert_eq!(paths.len(), 2, "{paths:?}");
    let (before, last) = (&paths[0], &paths[1]);
    let bytes = fs::read(last)?;
    // Cut off, and changed in a bit at places all over the file.
    let cuts = [0, 1, bytes.len() / 2, bytes.len() - 1].map(|len| bytes[..len].to_vec());
    let flips = (0..40).map(|part| {
        let mut bytes = bytes.clone();
        let at = part * bytes.len() / 40 + 11;
        bytes[at] ^= 1;
        bytes
    });
    let mut refused = 0;
    for damaged in cuts.into_iter().chain(flips) {
        fs::write(last, damaged)?;
        match Trainer::resume(make, folder.path(), 1) {
            Err(CheckpointError::Damaged { path, before: Some(other), .. }) => {
                assert_eq!((&path, &other), (last, before));
                refused += 1;
            }
            // A bit that means nothing, such as one of the date.
            Ok(resumed) => assert!(outcome(&resumed)? == outcome(&trainer)?),
            other => panic!("{other:?}"),
        }
    }
    assert!(refused >= 40, "{refused}");
    fs::remove_file(last)?;
    Trainer::resume(make, folder.path(), 1)?;
    Ok(())
}

#[test]
fn a_checkpoint_of_another_environment_is_refused() -> Result {
    let folder = tempdir()?;
    let mut trainer = Trainer::new(make, settings(ddpg()), 1, 1)?;
    trainer.cycle()?;
    trainer.save(folder.path())?;
    let other = Trainer::resume(|| Ok(make_kinematic("FetchPush-v4")?), folder.path(), 1);
    assert!(matches!(other, Err(CheckpointError::Foreign { .. })), "{other:?}");
    Ok(())
}

#[test]
fn a_folder_begins_a_run_once_and_then_continues_it() -> Result {
    let folder = tempdir()?;
    let settings = settings(ddpg());
    for place in [folder.path().join("missing"), folder.path().to_owned()] {
        let begun = Trainer::resume_or_new(make, settings.clone(), 1, 1, place)?;
        assert_eq!(begun.counters().steps, 0);
    }
    let mut trainer = Trainer::new(make, settings.clone(), 1, 1)?;
    trainer.cycle()?;
    trainer.save(folder.path())?;
    let resumed = Trainer::resume_or_new(make, settings.clone(), 1, 1, folder.path())?;
    assert_eq!(resumed.counters(), trainer.counters());

    let seed = Trainer::resume_or_new(make, settings.clone(), 2, 1, folder.path());
    let mut other = settings;
    other.replay.future_k = 2.0;
    let other = Trainer::resume_or_new(make, other, 1, 1, folder.path());
    for (refused, expected) in [(seed, "the seed 1"), (other, "other settings")] {
        let Err(CheckpointError::OtherSettings { what, .. }) = refused else {
            panic!("{refused:?}");
        };
        assert_eq!(what, expected);
    }
    Ok(())
}
