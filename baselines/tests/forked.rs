//! What happens to a trainer in a forked child process.
#![cfg(unix)]

use baselines::learn::{CheckpointError, TrainError, TrainSettings, Trainer};
use fetch_env::vec_env::VecEnvError;
use fetch_env::{Task, make_kinematic};
use tempfile::tempdir;
use testing::{Result, in_child};

#[test]
fn a_trainer_from_before_the_fork_says_so_and_a_resumed_one_goes_on() -> Result {
    let mut settings = TrainSettings::fast(Task::Reach);
    settings.schedule.evaluation_episodes = 2;
    settings.schedule.updates_per_cycle = 2;
    settings.replay.batch_size = 16;
    let make = || Ok(make_kinematic("FetchReach-v4")?);
    let folder = tempdir()?;
    let mut trainer = Trainer::new(make, settings, 0, 2)?;
    while trainer.counters().updates == 0 {
        trainer.cycle()?;
    }
    trainer.save(folder.path())?;
    let mut trainer = Some(trainer);
    let next = |trainer: &mut Trainer<_>| -> Result<f64, TrainError> {
        trainer.cycle()?;
        Ok(trainer.evaluate()?.final_distance_mean)
    };
    in_child(|| {
        let mut before = trainer.take().ok_or("the child has it, too")?;
        assert!(matches!(before.cycle(), Err(TrainError::Forked)));
        assert!(matches!(before.evaluate(), Err(TrainError::Forked)));
        let saved = before.save(folder.path());
        assert!(matches!(saved, Err(CheckpointError::Envs(VecEnvError::Forked))), "{saved:?}");
        drop(before);
        let distance = next(&mut Trainer::resume(make, folder.path(), 2)?)?;
        assert_eq!(distance, next(&mut Trainer::resume(make, folder.path(), 1)?)?);
        Ok(())
    })?;
    let mut trainer = trainer.ok_or("the parent still has it")?;
    let distance = next(&mut trainer)?;
    assert_eq!(distance, next(&mut Trainer::resume(make, folder.path(), 2)?)?);
    Ok(())
}
