//! Runs: they learn, and their results depend on settings and seed alone.

use std::ops::ControlFlow;

use baselines::learn::{
    AlgorithmSettings, CurveRow, DdpgSettings, SacSettings, Target, TrainSettings, Trainer,
};
use fetch_env::wrappers::Wrapped;
use fetch_env::{EnvError, FetchEnv, Task, TimeLimit, make_kinematic};
use fetch_sim::KinematicSimulator;

pub(crate) type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;
pub(crate) type Kinematic = Wrapped<FetchEnv<KinematicSimulator>, TimeLimit>;

pub(crate) fn make() -> Result<Kinematic, EnvError> {
    Ok(make_kinematic("FetchReach-v4")?)
}

/// Small networks and short evaluations.
pub(crate) fn settings(algorithm: AlgorithmSettings) -> TrainSettings {
    let mut settings = TrainSettings::fast(Task::Reach);
    settings.algorithm = algorithm;
    settings.schedule.evaluation_episodes = 10;
    settings.replay.batch_size = 64;
    settings
}

pub(crate) fn ddpg() -> AlgorithmSettings {
    let hidden = vec![32, 32];
    AlgorithmSettings::Ddpg(DdpgSettings {
        hidden,
        action_l2: 0.5,
        actor_learning_rate: 0.001,
        critic_learning_rate: 0.001,
        average_fraction: 1.0,
        ..DdpgSettings::default()
    })
}

pub(crate) fn sac() -> AlgorithmSettings {
    AlgorithmSettings::Sac(SacSettings { hidden: vec![32, 32], ..SacSettings::default() })
}

/// The rows of a curve without the time that they took, and the policy.
pub(crate) type Outcome = (Vec<CurveRow>, Vec<u8>);

pub(crate) fn outcome(trainer: &Trainer<Kinematic>) -> Result<Outcome> {
    let mut rows = trainer.rows().to_vec();
    rows.iter_mut().for_each(|row| row.counters.seconds = 0.0);
    Ok((rows, trainer.policy("FetchReach-v4")?.to_bytes()?))
}

fn run(settings: TrainSettings, seed: u64, threads: usize, steps: u64) -> Result<Outcome> {
    let mut trainer = Trainer::new(make, settings, seed, threads)?;
    trainer.run(steps, None, |_, _| ControlFlow::Continue(()))?;
    outcome(&trainer)
}

#[test]
fn both_algorithms_learn_to_reach() -> Result {
    for algorithm in [ddpg(), sac()] {
        let mut trainer = Trainer::new(make, settings(algorithm.clone()), 1, 2)?;
        let target = Target { success_rate: 1.0, evaluations: 2 };
        trainer.run(12_000, Some(target), |_, _| ControlFlow::Continue(()))?;
        assert!(target.is_reached(trainer.rows()), "{algorithm:?}: {:?}", trainer.rows().last());
    }
    Ok(())
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() -> Result {
    for algorithm in [ddpg(), sac()] {
        let one = run(settings(algorithm.clone()), 3, 1, 600)?;
        for threads in [2, 4] {
            assert!(run(settings(algorithm.clone()), 3, threads, 600)? == one, "{threads} threads");
        }
        assert!(run(settings(algorithm), 4, 1, 600)? != one, "another seed");
    }
    Ok(())
}

#[test]
fn a_run_ends_at_its_target_or_where_the_caller_says() -> Result {
    let mut trainer = Trainer::new(make, settings(ddpg()), 1, 1)?;
    let always = Target { success_rate: 0.0, evaluations: 2 };
    trainer.run(2_000, Some(always), |_, _| ControlFlow::Continue(()))?;
    assert_eq!(trainer.rows().len(), 2);
    trainer.run(2_000, None, |_, _| ControlFlow::Break(()))?;
    assert_eq!(trainer.rows().len(), 3);
    Ok(())
}
