//! The trainer treats the algorithm like its own: it learns, the same seed gives the same bits, and
//! so does a run that was resumed.

use std::error::Error;
use std::ops::ControlFlow;

use baselines::TrainedPolicy;
use baselines::learn::{AlgorithmSettings, Resumed, Target, TrainError, TrainSettings, Trainer};
use baselines::workers::OneProcess;
use fetch_env::variation::{Draw, Variation};
use fetch_env::{
    Env, EnvError, FetchConfig, KinematicEnv, MujocoEnv, RewardKind, Task, make_kinematic,
};
use own_algorithm::{Td3Settings, build};

type Result<T = (), E = Box<dyn Error>> = std::result::Result<T, E>;

const ENV_ID: &str = "FetchReach-v4";

fn make() -> Result<KinematicEnv, EnvError> {
    Ok(make_kinematic(ENV_ID)?)
}

fn trainer(seed: u64) -> Result<Trainer<KinematicEnv>> {
    let mut settings = TrainSettings::fast(Task::Reach);
    settings.algorithm = AlgorithmSettings::other(&Td3Settings::default())?;
    settings.replay.batch_size = 64;
    settings.schedule.evaluation_episodes = 20;
    Ok(Trainer::with_algorithm(make, settings, seed, 1, Box::new(OneProcess), build)?)
}

fn run(trainer: &mut Trainer<KinematicEnv>, steps: u64) -> Result<TrainedPolicy> {
    trainer.run(steps, None, |_, _| ControlFlow::Continue(()))?;
    Ok(trainer.policy(ENV_ID)?)
}

#[test]
fn it_learns_to_reach() -> Result {
    for seed in 0..3 {
        let mut trainer = trainer(seed)?;
        // Twice in a row, 20 of 20 episodes that it has not learned from.
        let target = Target { success_rate: 1.0, evaluations: 2 };
        trainer.run(10_000, Some(target), |_, _| ControlFlow::Continue(()))?;
        assert!(target.is_reached(trainer.rows()), "{seed}: {:?}", trainer.rows().last());
        let policy = trainer.policy(ENV_ID)?;
        assert_eq!(policy.header().algorithm, "td3");
        assert_eq!(policy.header().settings["algorithm"]["other"]["actor_interval"], 2);
    }
    Ok(())
}

/// Push, with a mass of the object and a friction that each episode draws.
fn make_varied() -> Result<MujocoEnv, EnvError> {
    let variation = Variation::default()
        .with("object_mass", Draw::LogUniform(0.5, 4.0))?
        .with("friction", 0.5..=2.0)?;
    let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_variation(variation);
    Ok(fetch_env::make(config)?)
}

#[test]
fn it_trains_where_mass_and_friction_vary() -> Result {
    let mut env = make_varied()?;
    let mut masses = Vec::new();
    for _ in 0..10 {
        env.reset(None)?;
        masses.extend(env.inner().variation().get("object_mass"));
    }
    masses.dedup();
    assert_eq!(masses.len(), 10, "{masses:?}");
    let mut settings = TrainSettings::fast(Task::Push);
    settings.algorithm = AlgorithmSettings::other(&Td3Settings::default())?;
    settings.schedule.evaluation_episodes = 2;
    let workers = Box::new(OneProcess);
    let mut trainer = Trainer::with_algorithm(make_varied, settings, 0, 1, workers, build)?;
    trainer.run(1_000, None, |_, _| ControlFlow::Continue(()))?;
    trainer.policy("FetchPush-v4")?;
    Ok(())
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_seed_others() -> Result {
    let mut policies = Vec::new();
    for seed in [0, 0, 1] {
        policies.push(run(&mut trainer(seed)?, 1_000)?);
    }
    assert_eq!(policies[0], policies[1]);
    assert_ne!(policies[0], policies[2]);
    Ok(())
}

#[test]
fn a_resumed_run_has_the_bits_of_one_that_was_never_stopped() -> Result {
    let folder = tempfile::tempdir()?;
    let mut stopped = trainer(3)?;
    run(&mut stopped, 800)?;
    stopped.save(&folder)?;
    drop(stopped);
    let workers = Box::new(OneProcess);
    let (mut resumed, how) = Trainer::resume_with_algorithm(make, &folder, 1, workers, build)?;
    assert_eq!(how, Resumed::Exactly);
    assert_eq!(run(&mut resumed, 1_600)?, run(&mut trainer(3)?, 1_600)?);
    Ok(())
}

#[test]
fn a_run_without_its_builder_or_with_other_settings_is_refused() -> Result {
    let mut settings = TrainSettings::fast(Task::Reach);
    settings.algorithm = AlgorithmSettings::other(&Td3Settings::default())?;
    let error = Trainer::new(make, settings.clone(), 0, 1).expect_err("nothing builds it");
    assert!(error.to_string().contains("with_algorithm"), "{error}");
    settings.algorithm = TrainSettings::fast(Task::Reach).algorithm;
    let error = Trainer::with_algorithm(make, settings, 0, 1, Box::new(OneProcess), build)
        .expect_err("its settings are DDPG's");
    assert!(matches!(error, TrainError::Algorithm(_)), "{error}");
    Ok(())
}
