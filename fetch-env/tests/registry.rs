//! The eight names and their configurations.

use fetch_env::{ConfigError, EnvError, EnvId, FetchConfig, FetchEnv, make_kinematic};
use fetch_sim::{KinematicSimulator, SimConfig, Task};
use goal_reward::RewardKind;
use proptest::prelude::*;

#[test]
fn the_names_are_gymnasiums() {
    let names = EnvId::ALL.map(|id| id.to_string());
    assert_eq!(
        names,
        [
            "FetchReach-v4",
            "FetchReachDense-v4",
            "FetchPush-v4",
            "FetchPushDense-v4",
            "FetchPickAndPlace-v4",
            "FetchPickAndPlaceDense-v4",
            "FetchSlide-v4",
            "FetchSlideDense-v4",
        ]
    );
    for (id, name) in EnvId::ALL.into_iter().zip(&names) {
        assert_eq!(name.parse(), Ok(id));
        assert_eq!(serde_json::to_string(&id).expect("serializable"), format!("{name:?}"));
        assert_eq!(serde_json::from_str::<EnvId>(&format!("{name:?}")).expect("a name"), id);
        let env = make_kinematic(name).expect("a name");
        assert_eq!(env.inner().config(), &id.config());
    }
}

#[test]
fn an_unknown_name_is_answered_with_the_nearest() {
    for (unknown, nearest) in [
        ("FetchPush-v3", "FetchPush-v4"),
        ("fetchpush-v4", "FetchPush-v4"),
        ("FetchSlideDense", "FetchSlideDense-v4"),
        ("FetchPickandPlace-v2", "FetchPickAndPlace-v4"),
        ("Reach", "FetchReach-v4"),
    ] {
        let error = make_kinematic(unknown).expect_err("no such environment");
        let EnvError::UnknownId(error) = error else { panic!("{error}") };
        assert_eq!(error.id, unknown);
        assert_eq!(error.nearest[0].to_string(), nearest, "for {unknown}");
        let message = error.to_string();
        assert!(message.contains(unknown) && message.contains(nearest), "{message}");
    }
}

proptest! {
    #[test]
    fn only_the_eight_names_are_known(name in ".{0,30}") {
        let known = EnvId::ALL.iter().any(|id| id.to_string() == name);
        prop_assert_eq!(name.parse::<EnvId>().is_ok(), known);
    }

    #[test]
    fn configurations_survive_json_and_are_checked_like_the_builder(
        task in prop::sample::select(Task::ALL.to_vec()),
        range in prop_oneof![Just(f64::NAN), Just(-1.0), 0.0..0.2, Just(f64::MAX)],
        threshold in prop_oneof![Just(f64::INFINITY), -0.01..0.1],
        steps in 0..3_u32,
        substeps in 0..3_u32,
        in_the_air: bool,
    ) {
        let builder = FetchConfig::builder(task)
            .object_range(range)
            .distance_threshold(threshold)
            .max_episode_steps(steps)
            .n_substeps(substeps)
            .target_in_the_air(in_the_air);
        let valid = task.has_object()
            && (0.075..1e300).contains(&range)
            && (0.0..1e300).contains(&threshold)
            && steps > 0
            && substeps > 0;
        let built = builder.clone().build();
        prop_assert_eq!(built.is_ok(), valid, "{:?}", built);
        // JSON has neither NaN nor infinity.
        if range.is_finite() && threshold.is_finite() {
            let json = serde_json::to_string(&builder).expect("serializable");
            prop_assert_eq!(serde_json::from_str::<FetchConfig>(&json).ok(), built.ok());
        }
    }
}

#[test]
fn the_defaults_are_the_references() {
    for id in EnvId::ALL {
        let config = id.config();
        let slide = id.task == Task::Slide;
        assert_eq!(config.task(), id.task);
        assert_eq!(config.sim(), &SimConfig::new(id.task));
        assert_eq!(config.control_period(), 0.04);
        assert_eq!(config.reward().kind(), id.reward);
        assert_eq!(config.reward().threshold().get(), 0.05);
        assert_eq!(config.max_episode_steps().get(), 50);
        let object_range = if slide { 0.1 } else { 0.15 };
        assert_eq!(config.object_range(), id.task.has_object().then_some(object_range));
        assert_eq!(config.target_range(), if slide { 0.3 } else { 0.15 });
        assert_eq!(config.target_offset(), if slide { [0.4, 0.0, 0.0] } else { [0.0; 3] });
        assert_eq!(config.target_in_the_air(), id.task == Task::PickAndPlace);
    }
}

#[test]
fn each_impossible_configuration_is_named() {
    let push = || FetchConfig::builder(Task::Push);
    let reach = || FetchConfig::builder(Task::Reach);
    let no_object = |option| ConfigError::NoObject { task: Task::Reach, option };
    let range = |option, value, least| ConfigError::Range { option, value, least };
    for (builder, error) in [
        (reach().object_range(0.1), no_object("object_range")),
        (reach().target_in_the_air(true), no_object("target_in_the_air")),
        // No offset within it would be 0.1 m long.
        (push().object_range(0.07), range("object_range", 0.07, 0.075)),
        (push().target_range(-0.1), range("target_range", -0.1, 0.0)),
        (push().target_range(f64::MAX), range("target_range", f64::MAX, 0.0)),
        (
            push().target_offset([0.0, f64::INFINITY, 0.0]),
            ConfigError::Offset { axis: 1, value: f64::INFINITY },
        ),
        (push().n_substeps(0), ConfigError::Zero { option: "n_substeps" }),
        (push().max_episode_steps(0), ConfigError::Zero { option: "max_episode_steps" }),
    ] {
        assert_eq!(builder.build(), Err(error));
    }
    let threshold = push().distance_threshold(-1.0).build();
    assert!(matches!(threshold, Err(ConfigError::Threshold(_))), "{threshold:?}");
}

#[test]
fn a_simulator_of_another_configuration_is_refused() {
    let config = FetchConfig::new(Task::Push, RewardKind::Sparse);
    let coarse = FetchConfig::builder(Task::Push).n_substeps(10).build().expect("valid");
    for simulator in [&SimConfig::new(Task::Slide), coarse.sim()] {
        let refusal = FetchEnv::new(config.clone(), KinematicSimulator::new(simulator));
        assert!(matches!(refusal, Err(EnvError::SimulatorMismatch { .. })), "{refusal:?}");
    }
}
