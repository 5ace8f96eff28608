//! Runs: they learn, and their results depend on settings and seed alone.

use std::ops::ControlFlow;

use baselines::learn::{
    AlgorithmSettings, CurveRow, DdpgSettings, PpoSettings, SacSettings, Target, TrainSettings,
    Trainer,
};
use fetch_env::wrappers::Wrapped;
use fetch_env::{EnvError, FetchEnv, Task, TimeLimit, make_kinematic};
use fetch_sim::KinematicSimulator;
use her_relabel::StateRows;

pub(crate) type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;
pub(crate) type Kinematic = Wrapped<FetchEnv<KinematicSimulator>, TimeLimit>;

pub(crate) fn make() -> Result<Kinematic, EnvError> {
    Ok(make_kinematic("FetchReach-v4")?)
}

/// Small networks and short evaluations.
pub(crate) fn settings(algorithm: AlgorithmSettings) -> TrainSettings {
    let mut settings = TrainSettings::fast(Task::Reach);
    settings.replay.batch_size = 64;
    if matches!(algorithm, AlgorithmSettings::Ppo(_)) {
        settings = TrainSettings::fast_ppo();
        settings.schedule.num_envs = 2;
        settings.schedule.evaluation_interval = Some(200);
    }
    settings.algorithm = algorithm;
    settings.schedule.evaluation_episodes = 10;
    settings
}

/// The same with everything that is off by default.
pub(crate) fn all_on(algorithm: AlgorithmSettings) -> TrainSettings {
    let mut settings = settings(algorithm);
    settings.exploration.far_start_share = 0.5;
    settings.inputs.left_out = vec![1];
    match &mut settings.algorithm {
        AlgorithmSettings::Ddpg(ddpg) => {
            ddpg.halving_start = 20;
            ddpg.halving_interval = Some(2_000);
        }
        AlgorithmSettings::Ppo(ppo) => {
            ppo.entropy_weight = 0.01;
            ppo.target_kl = Some(0.01);
            return settings;
        }
        _ => {}
    }
    settings.replay.mirrored = 0.5;
    settings.replay.goal_noise = 0.04;
    settings.replay.goal_noise_share = 0.5;
    settings.replay.distance_factor = 1.25;
    settings.replay.n_step = 3;
    settings.replay.n_step_updates = Some(60);
    settings.exploration.max_action_hold = 5;
    settings.exploration.max_random_start_steps = 3;
    settings.exploration.noise_free_share = 0.25;
    settings.inputs.actor_observation_noise = 0.01;
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

pub(crate) fn ppo() -> AlgorithmSettings {
    let hidden = vec![32, 32];
    AlgorithmSettings::Ppo(PpoSettings { hidden, minibatches: 4, ..PpoSettings::default() })
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
        for settings in [settings(algorithm.clone()), all_on(algorithm)] {
            let mut trainer = Trainer::new(make, settings.clone(), 1, 2)?;
            let target = Target { success_rate: 1.0, evaluations: 2 };
            trainer.run(12_000, Some(target), |_, _| ControlFlow::Continue(()))?;
            assert!(target.is_reached(trainer.rows()), "{settings:?}: {:?}", trainer.rows().last());
        }
    }
    Ok(())
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() -> Result {
    for algorithm in [ddpg(), sac(), ppo()] {
        let settings = all_on(algorithm);
        let one = run(settings.clone(), 3, 1, 600)?;
        for threads in [2, 4] {
            assert!(run(settings.clone(), 3, threads, 600)? == one, "{threads} threads");
        }
        assert!(run(settings, 4, 1, 600)? != one, "another seed");
    }
    Ok(())
}

#[test]
fn windows_of_several_steps_end_after_their_updates() -> Result {
    let learned = |n_step, n_step_updates| {
        let mut settings = settings(ddpg());
        settings.replay.n_step = n_step;
        settings.replay.n_step_updates = n_step_updates;
        // Policies contain these settings, so only the curves can be equal.
        Ok::<_, Box<dyn std::error::Error>>(run(settings, 3, 1, 600)?.0)
    };
    let (one, three) = (learned(1, None)?, learned(3, None)?);
    assert!(learned(3, Some(0))? == one, "no update has a window");
    assert!(learned(3, Some(1_000))? == three, "all updates have one");
    let some = learned(3, Some(40))?;
    assert!(some != one && some != three, "the first 40 of 100 updates have one");
    Ok(())
}

#[test]
fn a_run_is_evaluated_as_often_as_its_settings_say_and_shows_what_it_has_led_to() -> Result {
    let mut settings = settings(ddpg());
    let mut steps_of_rows = |interval, steps| -> Result<Vec<u64>> {
        settings.schedule.evaluation_interval = interval;
        let mut trainer = Trainer::new(make, settings.clone(), 1, 1)?;
        trainer.run(steps, None, |_, _| ControlFlow::Continue(()))?;
        Ok(trainer.rows().iter().map(|row| row.counters.steps).collect())
    };
    // A cycle has 100 steps; the first one updates nothing.
    assert_eq!(steps_of_rows(Some(400), 1_000)?, [400, 800]);
    assert_eq!(steps_of_rows(Some(100_000), 500)?, [500]);
    assert_eq!(steps_of_rows(None, 500)?, [200, 300, 400, 500]);
    // A twentieth is two and a half cycles.
    let twentieths = (1..=20_u64).map(|number| (250 * number).next_multiple_of(100));
    assert_eq!(steps_of_rows(None, 5_000)?, twentieths.collect::<Vec<_>>());
    // The last one is at the end, though no twentieth ends there.
    assert_eq!(steps_of_rows(None, 2_150)?.last(), Some(&2_200));
    // Before the first update.
    assert_eq!(steps_of_rows(None, 100)?, [100]);
    Ok(())
}

#[test]
fn a_policy_does_not_depend_on_what_was_left_out() -> Result {
    let mut settings = settings(ddpg());
    settings.inputs.left_out = vec![1, 4];
    let mut trainer = Trainer::new(make, settings, 1, 1)?;
    trainer.run(1_000, None, |_, _| ControlFlow::Continue(()))?;
    let mut policy = trainer.policy("FetchReach-v4")?;
    let mut action = |changed: Option<usize>| -> Result<[f32; 4]> {
        let mut observation = [0.1_f64; 10];
        if let Some(element) = changed {
            observation[element] = 0.9;
        }
        let states = StateRows {
            observation: &observation,
            achieved_goal: &[0.1; 3],
            desired_goal: &[0.2; 3],
        };
        let mut action = [0.0; 4];
        policy.act_rows(&states, &mut action)?;
        Ok(action)
    };
    let unchanged = action(None)?;
    assert_eq!([action(Some(1))?, action(Some(4))?], [unchanged; 2]);
    assert_ne!(action(Some(0))?, unchanged);
    Ok(())
}

#[test]
fn settings_that_presume_nothing_are_read_as_they_are_written() -> Result {
    let settings = TrainSettings::default();
    let json = serde_json::to_string(&settings)?;
    assert!(json.contains(r#""evaluation_interval":null"#), "{json}");
    assert_eq!(serde_json::from_str::<TrainSettings>(&json)?, settings);
    assert_eq!(
        (settings.replay.keep_motionless, settings.replay.keep_already_achieved),
        (1.0, 1.0)
    );
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
