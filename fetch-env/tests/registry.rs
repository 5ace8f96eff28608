//! The eight names and their settings.

use fetch_env::{EnvId, FetchConfig, FetchEnv, MakeError, make_kinematic};
use fetch_sim::{KinematicSimulator, ModelSource, SimConfig, Task};
use goal_reward::{DistanceThreshold, RewardKind};
use proptest::prelude::*;
use testing::Result;

#[test]
fn the_names_are_gymnasiums() -> Result {
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
        assert_eq!(serde_json::to_string(&id)?, format!("{name:?}"));
        assert_eq!(serde_json::from_str::<EnvId>(&format!("{name:?}"))?, id);
        let env = make_kinematic(name)?;
        assert_eq!(env.inner().config(), &id.config());
    }
    Ok(())
}

#[test]
fn the_error_for_an_unknown_name_lists_the_nearest() {
    for (unknown, nearest) in [
        ("FetchPush-v3", "FetchPush-v4"),
        ("fetchpush-v4", "FetchPush-v4"),
        ("FetchSlideDense", "FetchSlideDense-v4"),
        ("FetchPickandPlace-v2", "FetchPickAndPlace-v4"),
        ("Reach", "FetchReach-v4"),
    ] {
        let error = make_kinematic(unknown).expect_err("no such environment");
        let message = error.to_string();
        let MakeError::UnknownId { id, nearest: known } = error else { panic!("{message}") };
        assert_eq!(id, unknown);
        assert_eq!(known[0], nearest, "for {unknown}");
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
    fn settings_survive_json_and_are_checked_when_read(
        task in prop::sample::select(Task::ALL.to_vec()),
        range in prop_oneof![Just(f64::NAN), Just(-1.0), 0.0..0.2, Just(f64::MAX)],
        threshold in prop_oneof![Just(f64::INFINITY), -0.01..0.1],
        steps in 0..3_u32,
        substeps in 0..3_u32,
        in_the_air: bool,
    ) {
        let config = FetchConfig::new(task, RewardKind::Sparse)
            .with_object_range(range)
            .and_then(|config| config.with_distance_threshold(threshold))
            .and_then(|config| config.with_max_episode_steps(steps))
            .and_then(|config| config.with_n_substeps(substeps))
            .and_then(|config| config.with_target_in_the_air(in_the_air));
        let valid = task.has_object()
            && (0.075..1e300).contains(&range)
            && (0.0..1e300).contains(&threshold)
            && steps > 0
            && substeps > 0;
        prop_assert_eq!(config.is_ok(), valid, "{:?}", config);
        // JSON has neither NaN nor infinity.
        if range.is_finite() && threshold.is_finite() {
            let mut json = serde_json::to_value(FetchConfig::new(Task::Push, RewardKind::Sparse))?;
            json["sim"]["task"] = serde_json::to_value(task)?;
            json["sim"]["n_substeps"] = substeps.into();
            json["object_range"] = range.into();
            json["distance_threshold"] = threshold.into();
            json["max_episode_steps"] = steps.into();
            json["target_in_the_air"] = in_the_air.into();
            json["target_range"] = task.spec().goal.range.into();
            json["target_offset"] = serde_json::to_value(task.spec().goal.offset)?;
            prop_assert_eq!(serde_json::from_value::<FetchConfig>(json).ok(), config.ok());
        }
    }
}

#[test]
fn the_defaults_are_the_references() -> Result {
    for id in EnvId::ALL {
        let config = id.config();
        let slide = id.task == Task::Slide;
        assert_eq!(config.task(), id.task);
        assert_eq!(*config.sim(), SimConfig::new(id.task));
        let folder = ModelSource::Folder("models".into());
        assert_eq!(config.clone().with_model(folder.clone()).sim().model(), &folder);
        assert_eq!(config.control_period(), 0.04);
        assert_eq!(config.reward(), id.reward);
        assert_eq!(config.distance_threshold(), DistanceThreshold::FETCH);
        assert_eq!(config.max_episode_steps().get(), 50);
        let object_range = if slide { 0.1 } else { 0.15 };
        assert_eq!(config.object_range(), id.task.has_object().then_some(object_range));
        assert_eq!(config.target_range(), if slide { 0.3 } else { 0.15 });
        assert_eq!(config.target_offset(), if slide { [0.4, 0.0, 0.0] } else { [0.0; 3] });
        assert_eq!(config.target_in_the_air(), id.task == Task::PickAndPlace);
    }
    Ok(())
}

#[test]
fn the_serialized_settings_have_these_keys() -> Result {
    let json = concat!(
        r#"{"sim":{"task":"push","n_substeps":20,"model":"builtin","contact_filter":true},"#,
        r#""reward":"dense","distance_threshold":0.05,"object_range":0.15,"target_range":0.15,"#,
        r#""target_offset":[0.0,0.0,0.0],"target_in_the_air":false,"max_episode_steps":50}"#,
    );
    let config = FetchConfig::new(Task::Push, RewardKind::Dense);
    assert_eq!(serde_json::to_string(&config)?, json);
    let defaults =
        [r#""model":"builtin","#, r#","contact_filter":true"#, r#""object_range":0.15,"#];
    for default in defaults {
        assert_eq!(serde_json::from_str::<FetchConfig>(&json.replace(default, ""))?, config);
    }
    let unknown = json.replace("n_substeps", "substeps");
    assert!(serde_json::from_str::<FetchConfig>(&unknown).is_err());
    Ok(())
}

#[test]
fn each_invalid_setting_is_named() -> Result {
    let push = || FetchConfig::new(Task::Push, RewardKind::Sparse);
    let reach = || FetchConfig::new(Task::Reach, RewardKind::Sparse);
    let no_object = |option| MakeError::NoObject { task: Task::Reach, option };
    let range = |option, value, least| MakeError::Range { option, value, least, most: 1000.0 };
    let count = |option, value, most| MakeError::Count { option, value, most };
    for (config, error) in [
        (reach().with_object_range(0.1), no_object("object_range")),
        (reach().with_target_in_the_air(true), no_object("target_in_the_air")),
        // In this range no offset is 0.1 m long.
        (push().with_object_range(0.07), range("object_range", 0.07, 0.075)),
        (push().with_target_range(-0.1), range("target_range", -0.1, 0.0)),
        (push().with_target_range(f64::MAX), range("target_range", f64::MAX, 0.0)),
        (
            push().with_target_offset([0.0, f64::INFINITY, 0.0]),
            MakeError::Offset { axis: 1, value: f64::INFINITY, most: 1000.0 },
        ),
        (push().with_target_range(8e307), range("target_range", 8e307, 0.0)),
        (push().with_object_range(1000.1), range("object_range", 1000.1, 0.075)),
        (push().with_n_substeps(0), count("n_substeps", 0, 1000)),
        (push().with_n_substeps(u32::MAX), count("n_substeps", u32::MAX, 1000)),
        (push().with_max_episode_steps(0), count("max_episode_steps", 0, u32::MAX)),
    ] {
        assert_eq!(config, Err(error));
    }
    let threshold = push().with_distance_threshold(-1.0);
    assert!(matches!(threshold, Err(MakeError::Threshold(_))), "{threshold:?}");
    Ok(())
}

#[test]
fn a_simulator_of_another_configuration_is_refused() -> Result {
    let config = FetchConfig::new(Task::Push, RewardKind::Sparse);
    let coarse = config.clone().with_n_substeps(10)?;
    for sim in [SimConfig::new(Task::Slide), coarse.sim().clone()] {
        let refusal = FetchEnv::new(config.clone(), KinematicSimulator::new(&sim));
        assert!(matches!(refusal, Err(MakeError::SimulatorMismatch { .. })), "{refusal:?}");
    }
    Ok(())
}
