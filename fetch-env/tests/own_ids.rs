//! Registries: environments that users add, and their names.

use fetch_env::{
    Env, EnvError, EnvExt, EnvId, GoalEnv, KinematicEnv, Registry, RegistryError, TimeLimit,
    make_kinematic,
    wrappers::{EpisodeInfo, RecordEpisodeStatistics},
};
use proptest::prelude::*;
use testing::Result;

/// Makes one of the eight environments, and says so by its name in the error if it cannot.
fn constructor(id: &'static str) -> impl Fn() -> std::result::Result<KinematicEnv, EnvError> {
    move || Ok(make_kinematic(id)?)
}

#[test]
fn a_registry_begins_with_the_eight_environments() -> Result {
    let registry = Registry::kinematic();
    let mut names = EnvId::ALL.map(|id| id.to_string());
    names.sort();
    assert!(registry.ids().eq(&names));
    for id in EnvId::ALL {
        let env = registry.make(&id.to_string())?;
        assert_eq!(env.inner().config(), &id.config());
    }
    let debugged = format!("{registry:?}");
    assert!(names.iter().all(|name| debugged.contains(name)), "{debugged}");
    Ok(())
}

#[test]
fn a_name_without_a_version_means_the_newest() -> Result {
    let mut registry = Registry::new();
    registry.register("Robot-v2", constructor("FetchReach-v4"))?;
    registry.register("Robot-v10", constructor("FetchPush-v4"))?;
    registry.register("lab/Robot-v11", constructor("FetchSlide-v4"))?;
    registry.register("Robot-vision-v12", constructor("FetchSlide-v4"))?;
    let task = |id| Ok::<_, EnvError>(registry.make(id)?.inner().config().task().to_string());
    assert_eq!(task("Robot-v2")?, "Reach");
    assert_eq!(task("Robot-v10")?, "Push");
    assert_eq!(task("Robot")?, "Push");
    assert_eq!(task("lab/Robot")?, "Slide");
    assert!(registry.make("Robot-v3").is_err());
    assert!(registry.make("robot").is_err());
    Ok(())
}

#[test]
fn the_error_for_an_unknown_name_lists_the_nearest() -> Result {
    let mut registry = Registry::kinematic();
    registry.register("lab/Juggle-v1", constructor("FetchPush-v4"))?;
    for (unknown, nearest) in [
        ("lab/juggle-v2", "lab/Juggle-v1"),
        ("Jugle-v1", "lab/Juggle-v1"),
        ("FetchPush-v3", "FetchPush-v4"),
    ] {
        let error = registry.make(unknown).expect_err("no such environment");
        let RegistryError::Unknown { id, nearest: names } = &error else { panic!("{error}") };
        assert_eq!(id, unknown);
        assert_eq!((names.len(), names[0].as_str()), (3, nearest));
        let message = error.to_string();
        assert!(message.contains(unknown) && message.contains(nearest), "{message}");
    }
    let error = Registry::<KinematicEnv>::new().make("A-v0").expect_err("no environment");
    assert_eq!(error.to_string(), r#"there is no environment "A-v0": register one first"#);
    Ok(())
}

#[test]
fn names_are_checked_and_taken_once() -> Result {
    let mut registry = Registry::kinematic();
    for id in ["", "/A-v1", "a/", "a/b/C-v1", "A b-v1", "A-v1/", "-v1", "Reach\n"] {
        let refusal = registry.register(id, constructor("FetchPush-v4"));
        assert_eq!(refusal, Err(RegistryError::Malformed { id: id.into() }));
    }
    for id in ["A", "A-v0", "a.b:c_d-e/f-v03"] {
        let refusal = registry.register(id, constructor("FetchPush-v4"));
        assert_eq!(refusal.is_ok(), !id.contains('.'), "a namespace has no dot: {refusal:?}");
    }
    let refusal = registry.register("FetchPush-v4", constructor("FetchPush-v4"));
    assert_eq!(refusal, Err(RegistryError::Taken { id: "FetchPush-v4".into() }));
    Ok(())
}

#[test]
fn a_changed_registry_takes_environments_of_other_types() -> Result {
    type AnyEnv = Box<
        dyn GoalEnv<
                Observation = <KinematicEnv as Env>::Observation,
                Info = EpisodeInfo<<KinematicEnv as Env>::Info>,
                ActionSpace = <KinematicEnv as Env>::ActionSpace,
                ResetOptions = <KinematicEnv as Env>::ResetOptions,
                GoalReward = <KinematicEnv as GoalEnv>::GoalReward,
            >,
    >;
    let wrapped = Registry::kinematic().map(|env| env.wrap(RecordEpisodeStatistics::new()));
    let before = wrapped.ids().count();
    let mut registry = wrapped.map(|env| Ok(Box::new(env) as AnyEnv));
    registry.register("Short-v0", || {
        let limit = std::num::NonZeroU32::MIN;
        let env = make_kinematic("FetchPush-v4")?.into_inner().wrap(TimeLimit::new(limit))?;
        Ok(Box::new(env.wrap(RecordEpisodeStatistics::new())?))
    })?;
    assert_eq!(registry.ids().count(), before + 1);
    let mut env = registry.make("Short")?;
    env.reset(Some(0))?;
    let episode = env.step(&[0.0; 4])?.info.episode.ok_or("it is over")?;
    assert_eq!((episode.episode_return, episode.episode_length), (-1.0, 1));

    let failing = Registry::kinematic().map(|_| Err::<KinematicEnv, _>(EnvError::other("broken")));
    assert_eq!(
        failing.make("FetchPush-v4").map(drop),
        Err(RegistryError::Make(EnvError::other("broken")))
    );
    Ok(())
}

proptest! {
    #[test]
    fn whatever_is_registered_is_made_and_nothing_else(id in ".{0,12}", other in ".{0,12}") {
        let mut registry = Registry::new();
        let registered = registry.register(id.as_str(), constructor("FetchPush-v4")).is_ok();
        prop_assert_eq!(registry.make(&id).is_ok(), registered);
        let unversioned = id.strip_prefix(&other).is_some_and(|rest| rest.starts_with("-v"));
        let is_id = other == id || unversioned;
        prop_assert!(is_id || registry.make(&other).is_err());
    }
}

#[cfg(feature = "mujoco")]
#[test]
fn the_environments_on_mujoco_are_registered() -> Result {
    let registry = Registry::fetch();
    assert!(registry.ids().eq(Registry::kinematic().ids()));
    let mut env = registry.make("FetchReach")?;
    assert_eq!(env.reset(Some(3)), fetch_env::make("FetchReach-v4")?.reset(Some(3)));
    Ok(())
}
