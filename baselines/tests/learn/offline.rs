//! Demonstrations: updates from them alone, and what algorithms see of them.

use std::mem;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, Mutex};

use baselines::learn::{
    AlgorithmSettings, DdpgSettings, Resumed, TrainError, TrainSettings, Trainer, Transitions,
};
use baselines::workers::{OneProcess, Workers};
use baselines::{ScriptedPolicy, collect};
use fetch_env::Task;
use tempfile::tempdir;

use crate::ranks::on_ranks;
use crate::runs::{Kinematic, Result, ddpg, make, outcome, settings};
use crate::watched;

/// The seed of the first demonstration.
const FIRST_SEED: u64 = 1 << 45;

fn demonstrate(trainer: &mut Trainer<Kinematic>, count: usize) -> Result {
    let mut script = ScriptedPolicy::new(Task::Reach);
    trainer.add_demonstrations(|buffer| -> Result {
        collect(&mut make()?, &mut script, count, FIRST_SEED, buffer, 0, |_| ())?;
        Ok(())
    })
}

/// Settings that imitate.
fn imitating() -> TrainSettings {
    let AlgorithmSettings::Ddpg(ddpg) = ddpg() else { unreachable!("they are of DDPG") };
    settings(AlgorithmSettings::Ddpg(DdpgSettings { imitation_weight: 100.0, ..ddpg }))
}

#[test]
fn demonstrations_alone_are_learned_and_the_run_goes_on() -> Result {
    let mut trainer = Trainer::new(make, imitating(), 0, 2)?;
    demonstrate(&mut trainer, 50)?;
    trainer.update(1_500)?;
    let row = trainer.evaluate()?;
    assert_eq!(row.success_rate.value, 1.0, "{row:?}");
    assert_eq!((row.counters.steps, row.counters.updates), (0, 1_500));
    assert_eq!(row.counters.demonstrations, 50);
    let losses = row.losses.ok_or("no losses of the updates")?;
    assert!(losses.critic > 0.0 && losses.actor.is_finite());

    trainer.run(400, None, |_, _| ControlFlow::Continue(()))?;
    assert_eq!(trainer.counters().steps, 400);
    // From the first episode on, it acts as it has learned to.
    let row = trainer.rows().last().ok_or("no row")?;
    assert!(row.counters.updates > 1_500 && row.success_rate.value >= 0.9, "{row:?}");
    Ok(())
}

#[test]
fn a_run_goes_on_after_demonstrations_in_its_middle() -> Result {
    let mut settings = imitating();
    settings.schedule.steps_per_cycle = 30;
    let mut trainer = Trainer::new(make, settings, 0, 1)?;
    // Each of the two environments is in its seventh episode.
    trainer.run(660, None, |_, _| ControlFlow::Continue(()))?;
    demonstrate(&mut trainer, 3)?;
    let failed = trainer.add_demonstrations(|buffer| -> Result {
        let mut script = ScriptedPolicy::new(Task::Reach);
        collect(&mut make()?, &mut script, 2, FIRST_SEED, buffer, 0, |_| ())?;
        Err("the next episode fails".into())
    });
    assert!(failed.is_err());
    assert_eq!(trainer.counters().demonstrations, 3);

    trainer.run(1_260, None, |_, _| ControlFlow::Continue(()))?;
    let counters = trainer.counters();
    assert_eq!((counters.steps, counters.episodes), (1_260, 2 * 12));
    assert_eq!(counters.discarded_episodes, 0);
    Ok(())
}

/// Goal-conditioned behavior cloning, and the same weighted by advantages.
#[test]
fn imitation_alone_is_enough_of_a_loss() -> Result {
    for advantage_factor in [0.0, 1.0] {
        let AlgorithmSettings::Ddpg(ddpg) = ddpg() else { unreachable!("they are of DDPG") };
        let settings = settings(AlgorithmSettings::Ddpg(DdpgSettings {
            action_l2: 0.0,
            value_weight: 0.0,
            imitation_weight: 1.0,
            advantage_factor,
            ..ddpg
        }));
        let mut trainer = Trainer::new(make, settings, 0, 2)?;
        demonstrate(&mut trainer, 50)?;
        trainer.update(1_500)?;
        let row = trainer.evaluate()?;
        assert_eq!(row.success_rate.value, 1.0, "{advantage_factor}: {row:?}");
    }
    Ok(())
}

#[test]
fn there_must_be_something_to_draw() -> Result {
    let mut trainer = Trainer::new(make, imitating(), 0, 1)?;
    assert!(matches!(trainer.update(1), Err(TrainError::NothingToDraw)));
    assert_eq!(trainer.counters().updates, 0);
    trainer.cycle()?;
    trainer.update(1)?;
    let errors = on_ranks(2, |workers| {
        let rank = workers.rank();
        let mut trainer = Trainer::with_workers(make, imitating(), 0, 1, workers)?;
        demonstrate(&mut trainer, usize::from(rank == 0)).expect("an episode");
        trainer.update(1)
    });
    for error in errors {
        assert!(matches!(error, Err(TrainError::NothingToDraw)), "{error:?}");
    }
    Ok(())
}

#[test]
fn inputs_are_normalized_by_demonstrations() -> Result {
    let mut trainer = Trainer::new(make, imitating(), 0, 1)?;
    demonstrate(&mut trainer, 4)?;
    let num_rows = |trainer: &Trainer<Kinematic>| -> Result<u64> {
        let policy = trainer.policy("FetchReach-v4")?;
        Ok(policy.header().observation_normalizer.as_ref().ok_or("no normalizer")?.count())
    };
    assert_eq!(num_rows(&trainer)?, 0);
    trainer.update(1)?;
    assert_eq!(num_rows(&trainer)?, 4 * 50);
    // Demonstrations that were taken in are not taken in again.
    trainer.update(1)?;
    assert_eq!(num_rows(&trainer)?, 4 * 50);
    demonstrate(&mut trainer, 1)?;
    trainer.update(1)?;
    assert_eq!(num_rows(&trainer)?, 5 * 50);
    Ok(())
}

#[test]
fn a_resumed_run_learns_from_demonstrations_with_the_same_bits() -> Result {
    let folder = tempdir()?;
    let updates_and_run = |trainer: &mut Trainer<Kinematic>| -> Result<_> {
        trainer.update(30)?;
        trainer.run(300, None, |_, _| ControlFlow::Continue(()))?;
        trainer.update(30)?;
        trainer.evaluate()?;
        outcome(trainer)
    };
    let mut whole = Trainer::new(make, imitating(), 5, 2)?;
    demonstrate(&mut whole, 3)?;
    // With demonstrations that no update has seen, and in the middle of offline learning.
    whole.save(folder.path())?;
    let whole = updates_and_run(&mut whole)?;
    let mut resumed = Trainer::resume(make, folder.path(), 1)?;
    resumed.save(folder.path())?;
    resumed.update(10)?;
    resumed.save(folder.path())?;
    let mut resumed = Trainer::resume(make, folder.path(), 2)?;
    resumed.update(20)?;
    resumed.run(300, None, |_, _| ControlFlow::Continue(()))?;
    resumed.save(folder.path())?;
    let mut resumed = Trainer::resume(make, folder.path(), 1)?;
    resumed.update(30)?;
    resumed.evaluate()?;
    assert!(outcome(&resumed)? == whole);
    Ok(())
}

/// Counters of a run, and what makes its trainers.
#[derive(Default)]
struct Counted(Arc<Mutex<[usize; 2]>>);

impl Counted {
    /// Counts the transitions of a batch, and those that are demonstrated.
    fn count(counts: &mut [usize; 2], batch: Transitions<'_>) {
        assert_eq!(batch.demonstrated.len(), batch.len);
        counts[0] += batch.len;
        counts[1] += batch.demonstrated.iter().filter(|is_demonstrated| **is_demonstrated).count();
    }

    fn start(&self, workers: Box<dyn Workers>) -> Result<Trainer<Kinematic>, TrainError> {
        let mut settings = imitating();
        // All transitions are equally likely.
        settings.replay.keep_already_achieved = 1.0;
        settings.replay.keep_motionless = 1.0;
        let build = watched::build(&self.0, Self::count);
        Trainer::with_algorithm(make, settings, 0, 1, workers, build)
    }

    fn resume(&self, folder: &Path, workers: Box<dyn Workers>) -> Result<Trainer<Kinematic>> {
        let build = watched::build(&self.0, Self::count);
        let resumed = Trainer::resume_with_algorithm(make, folder, 1, workers, build)?;
        assert_ne!(resumed.1, Resumed::Exactly);
        Ok(resumed.0)
    }

    /// Returns the share of demonstrated transitions since the last call.
    fn share(&self) -> f64 {
        let [all, demonstrated] = mem::take(&mut *self.0.lock().expect("no thread panics"));
        demonstrated as f64 / all as f64
    }
}

#[test]
fn algorithms_learn_which_transitions_are_demonstrated() -> Result {
    let counted = Counted::default();
    let mut trainer = counted.start(Box::new(OneProcess))?;
    demonstrate(&mut trainer, 4)?;
    trainer.update(50)?;
    assert_eq!(counted.share(), 1.0);
    trainer.run(400, None, |_, _| ControlFlow::Continue(()))?;
    counted.share();
    // 200 of 600, and then 2,200 of 2,600.
    for (added, expected) in [(0, 1.0 / 3.0), (40, 22.0 / 26.0)] {
        demonstrate(&mut trainer, added)?;
        trainer.update(50)?;
        let share = counted.share();
        assert!((share - expected).abs() < 0.03, "{share} instead of {expected}");
    }
    Ok(())
}

#[test]
fn demonstrations_are_still_known_on_another_number_of_processes() -> Result {
    let folder = tempdir()?;
    let path = folder.path();
    on_ranks(2, |workers| {
        let counted = Counted::default();
        let rank = workers.rank();
        let mut trainer = counted.start(workers).expect("the settings fit");
        trainer.run(200, None, |_, _| ControlFlow::Continue(())).expect("it runs");
        demonstrate(&mut trainer, 30 * rank).expect("episodes");
        trainer.save(path).expect("it is saved");
    });
    let counted = Counted::default();
    let mut trainer = counted.resume(path, Box::new(OneProcess))?;
    trainer.update(50)?;
    // 1,500 of 1,700.
    let share = counted.share();
    assert!((share - 15.0 / 17.0).abs() < 0.03, "{share}");
    Ok(())
}
