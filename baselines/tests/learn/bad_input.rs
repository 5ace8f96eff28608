//! Environments that fail, or return numbers that are not finite.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};

use baselines::evaluate_across_workers;
use baselines::learn::{RunError, TrainError, Trainer};
use baselines::{CollectorError, EvaluationError, RandomPolicy};
use fetch_env::wrappers::{
    KeepsGoals, Resetting, SharedArray, Stateless, TransformReward, VectorObservation, Wrapped,
    Wrapper,
};
use fetch_env::{
    ActionElement, Env, EnvError, EnvExt, GoalEnv, Reset, Space, Step, VecEnv, vec_env::VecConfig,
};

use crate::ranks::on_ranks;
use crate::runs::{Kinematic, Result, ddpg, make, settings};

/// The faults of a [`Faulty`] environment, each from a step on.
#[derive(Clone, Copy)]
struct Faults {
    /// The step from which observations are not finite.
    observation: u64,
    /// The step from which steps fail.
    failure: u64,
    /// The number of resets after which they fail.
    resets: u64,
}

const NEVER: u64 = u64::MAX;
const NONE: Faults = Faults { observation: NEVER, failure: NEVER, resets: NEVER };

struct Faulty {
    faults: Faults,
    steps: u64,
    resets: u64,
}

type Observation = <<Kinematic as Env>::Observation as VectorObservation>::Replaced<f64>;

impl Faulty {
    fn observe(&self, observation: <Kinematic as Env>::Observation) -> Observation {
        let mut vector = observation.vector().to_vec();
        if self.steps >= self.faults.observation {
            vector[2] = f64::NAN;
        }
        observation.replace(SharedArray::from(vector.as_slice()))
    }
}

impl Wrapper<Kinematic> for Faulty {
    type Observation = Observation;
    type Info = <Kinematic as Env>::Info;
    type ActionSpace = <Kinematic as Env>::ActionSpace;

    fn reset(
        &mut self,
        env: &mut Resetting<'_, Kinematic>,
        seed: Option<u64>,
        options: &<Kinematic as Env>::ResetOptions,
    ) -> Result<Reset<Observation, Self::Info>, EnvError> {
        self.resets += 1;
        if self.resets > self.faults.resets {
            return Err(EnvError::other(std::io::Error::other("the table is gone")));
        }
        let Reset { observation, info } = env.reset_with(seed, options)?;
        Ok(Reset { observation: self.observe(observation), info })
    }

    fn step(
        &mut self,
        env: &mut Kinematic,
        action: &[ActionElement<Kinematic>],
    ) -> Result<Step<Observation, Self::Info>, EnvError> {
        self.steps += 1;
        if self.steps >= self.faults.failure {
            return Err(EnvError::other(std::io::Error::other("the robot is on fire")));
        }
        let Step { observation, reward, terminated, truncated, info } = env.step(action)?;
        let observation = self.observe(observation);
        Ok(Step { observation, reward, terminated, truncated, info })
    }

    fn action_space<'a>(&'a self, env: &'a Kinematic) -> &'a Self::ActionSpace {
        env.action_space()
    }

    fn observation_space<'a>(&'a self, env: &'a Kinematic) -> &'a Space {
        env.observation_space()
    }
}

impl KeepsGoals for Faulty {}
impl Stateless for Faulty {}

type FaultyEnv = Wrapped<Kinematic, Faulty>;

fn make_faulty(faults: Faults) -> Result<FaultyEnv, EnvError> {
    make()?.wrap(Faulty { faults, steps: 0, resets: 0 })
}

fn trainer(faults: Faults) -> Result<Trainer<FaultyEnv>> {
    Ok(Trainer::new(|| make_faulty(faults), settings(ddpg()), 0, 1)?)
}

#[test]
fn transitions_are_not_mirrored_in_an_environment_without_symmetry() {
    let train = |mirrored| {
        let mut settings = settings(ddpg());
        settings.replay.mirrored = mirrored;
        Trainer::new(|| make_faulty(NONE), settings, 0, 1).map(drop)
    };
    match train(0.5) {
        Err(TrainError::Setting { name: "mirrored", value, expected }) => {
            assert_eq!(value, "0.5");
            assert!(expected.contains("GoalEnv::symmetries"), "{expected}");
        }
        other => panic!("{other:?}"),
    }
    assert!(train(0.0).is_ok());
}

#[test]
fn goals_of_other_episodes_are_refused_without_hindsight() -> Result {
    let settings = settings(ddpg()).with("future_k=0")?;
    Trainer::new(make, settings.clone(), 0, 1)?;
    match Trainer::new(make, settings.with("past_goal_weight=0.5")?, 0, 1) {
        Err(TrainError::Setting { name: "past_goal_weight", value, .. }) => {
            assert_eq!(value, "0.5")
        }
        other => panic!("{other:?}"),
    }
    Ok(())
}

#[test]
fn an_element_that_the_observation_does_not_have_cannot_be_left_out() -> Result {
    let mut settings = settings(ddpg());
    settings.inputs.left_out = vec![0, 9];
    Trainer::new(make, settings.clone(), 0, 1)?;
    settings.inputs.left_out = vec![3, 0, 3];
    let twice = Trainer::new(make, settings.clone(), 0, 1);
    assert!(matches!(twice, Err(TrainError::Setting { name: "left_out", .. })), "{twice:?}");
    settings.inputs.left_out = vec![0, 10];
    match Trainer::new(make, settings, 0, 1) {
        Err(TrainError::Setting { name: "left_out", value, .. }) => assert_eq!(value, "[0, 10]"),
        other => panic!("{other:?}"),
    }
    Ok(())
}

#[test]
fn a_reward_that_is_not_finite_stops_the_run() -> Result {
    let mut trainer = Trainer::new(
        || {
            let env = make()?;
            let reward = *env.goal_reward();
            env.wrap(TransformReward::with_goal_reward(reward, |_| f64::NAN))
        },
        settings(ddpg()),
        0,
        1,
    )?;
    match trainer.cycle() {
        Err(TrainError::Run { steps: 0, source, .. }) => {
            let RunError::Collect(error) = *source else { panic!("{source:?}") };
            assert!(matches!(error, CollectorError::NotFinite { .. }), "{error:?}");
            Ok(())
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_observation_that_is_not_finite_stops_the_run() -> Result {
    let mut trainer = trainer(Faults { observation: 70, ..NONE })?;
    trainer.cycle()?;
    match trainer.cycle() {
        Err(TrainError::Run { steps: 100, source, .. }) => {
            let RunError::Collect(error) = *source else { panic!("{source:?}") };
            assert!(matches!(error, CollectorError::NotFinite { env_index: 0, .. }), "{error:?}");
            Ok(())
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_observation_that_is_not_finite_stops_an_evaluation() -> Result {
    let mut trainer = trainer(Faults { observation: 20, ..NONE })?;
    match trainer.evaluate() {
        Err(TrainError::Run { source, .. }) => {
            let expected = "environment 0 returned an observation that is not finite";
            assert!(source.to_string().starts_with(expected), "{source}");
            Ok(())
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_run_stops_when_every_environment_fails() -> Result {
    let mut trainer = trainer(Faults { failure: 70, ..NONE })?;
    let error = (0..10).find_map(|_| trainer.cycle().err());
    match error {
        Some(TrainError::Run { steps, source, .. }) => {
            assert!(steps >= 100, "{steps}");
            let RunError::AllFailed { env_index: 0, source } = *source else {
                panic!("{source:?}")
            };
            assert!(source.to_string().contains("the robot is on fire"), "{source}");
            assert!(trainer.counters().discarded_episodes > 0);
            Ok(())
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_run_stops_when_environments_cannot_be_reset() -> Result {
    let faults = Faults { resets: 1, ..NONE };
    let mut all = trainer(faults)?;
    all.cycle()?;
    match all.cycle() {
        Err(TrainError::Run { steps: 100, source, .. }) => {
            let RunError::AllFailed { env_index: 0, source } = *source else {
                panic!("{source:?}")
            };
            assert!(source.to_string().contains("the table is gone"), "{source}");
        }
        other => panic!("{other:?}"),
    }
    // The first environment that is made provides the rewards; of the others, one keeps stepping.
    let made = AtomicU64::new(0);
    let make = || {
        let is_second = made.fetch_add(1, Ordering::Relaxed) == 2;
        make_faulty(if is_second { faults } else { NONE })
    };
    let mut one = Trainer::new(make, settings(ddpg()), 0, 1)?;
    match one.run(10_000, None, |_, _| ControlFlow::Continue(())) {
        Err(TrainError::Run { steps: 150, source, .. }) => {
            let RunError::Stuck { env_index: 1, source } = *source else { panic!("{source:?}") };
            assert!(source.to_string().contains("the table is gone"), "{source}");
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(one.counters().steps, 150);
    Ok(())
}

#[test]
fn environments_that_fail_but_can_be_reset_lose_their_episodes_alone() -> Result {
    let mut trainer = trainer(Faults { failure: 130, ..NONE })?;
    trainer.cycle()?;
    trainer.cycle()?;
    assert_eq!((trainer.counters().steps, trainer.counters().discarded_episodes), (200, 0));
    trainer.cycle()?;
    // Both lose the third episode after 29 steps, and one episode at each step after that.
    assert_eq!((trainer.counters().steps, trainer.counters().discarded_episodes), (258, 42));
    Ok(())
}

#[test]
fn a_failed_episode_has_its_number_among_those_of_all_ranks() {
    let faults = Faults { failure: 1, ..NONE };
    let numbers = |error| match error {
        EvaluationError::Environment { episode, seed, .. } => (episode, seed),
        other => panic!("{other:?}"),
    };
    let spread = on_ranks(2, |mut workers| {
        let envs: Vec<_> = (0..3).map(|_| make_faulty(faults).expect("an environment")).collect();
        let mut policy = RandomPolicy::new(envs[0].action_space(), 0);
        let mut envs = VecEnv::new(envs, VecConfig::default()).expect("environments of one kind");
        numbers(
            evaluate_across_workers(&mut *workers, &mut envs, &mut policy, 10, 100, |_| ())
                .unwrap_err(),
        )
    });
    assert_eq!(spread, [(0, 100), (5, 105)]);
    let of_trainers = on_ranks(2, |workers| {
        let make = || make_faulty(faults);
        let trainer = Trainer::with_workers(make, settings(ddpg()), 0, 1, workers);
        match trainer.expect("the settings fit").evaluate() {
            Err(TrainError::Evaluate(error)) => numbers(error).0,
            other => panic!("{other:?}"),
        }
    });
    assert_eq!(of_trainers, [0, 5]);
}
