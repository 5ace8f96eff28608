//! What wrappers refuse, and what they do after a failure.

use std::ops::Range;
use testing::with_each_number_replaced;

use fetch_env::{
    ActionElement, BoxSpace, Env, EnvError, EnvExt, FetchResetOptions, Reset, SnapshotEnv, Space,
    Step, TimeLimit, make_kinematic,
    spaces::SpaceError,
    wrappers::{
        DelayAction, DelayObservation, FilterObservation, FlattenObservation, FrameStack,
        LowPassAction, NormalizeObservation, RecordEpisodeStatistics, RescaleAction, Resetting,
        RunningStatistics, TimeAwareObservation, Wrapper,
    },
};

use super::{FRAMES, Result, STEPS, TWICE, push};

#[test]
fn settings_that_make_no_sense_are_refused() -> Result {
    let keys = |keys: &[&'static str]| {
        push()?.wrap(FlattenObservation::with_keys(keys.iter().copied())).map(drop)
    };
    let key = |key: &str| Err(EnvError::from(SpaceError::Key { key: key.into() }));
    assert_eq!(keys(&["observation", "image"]), key("image"));
    assert_eq!(keys(&["observation", "observation"]), key("observation"));
    assert_eq!(keys(&[]), Err(SpaceError::Nothing.into()));

    let filter = |range: Range<usize>| push()?.wrap(FilterObservation::new(range)).map(drop);
    assert_eq!(filter(3..26), Err(SpaceError::Element { index: 25, len: 25 }.into()));
    assert_eq!(filter(3..3), Err(SpaceError::Nothing.into()));

    let length = SpaceError::StatisticsLength { expected: 25, actual: 10 };
    let refusal = push()?.wrap(NormalizeObservation::frozen(RunningStatistics::new(10))).map(drop);
    assert_eq!(refusal, Err(length.into()));

    for (low, high) in [(1.0, 1.0), (1.0, -1.0), (f32::NEG_INFINITY, 0.0), (0.0, f32::INFINITY)] {
        let error = SpaceError::Bounds { low: low.into(), high: high.into() };
        assert_eq!(push()?.wrap(RescaleAction::new(low, high)).map(drop), Err(error.into()));
    }
    assert!(push()?.wrap(RescaleAction::new(f32::NAN, 1.0)).is_err());
    let unbounded = Liar { action_space: BoxSpace::unbounded(1).expect("small"), ..Liar::new() };
    let refusal = unbounded.wrap(RescaleAction::new(-1.0, 1.0)).map(drop);
    assert_eq!(refusal, Err(SpaceError::Unbounded.into()));
    Ok(())
}

#[test]
fn a_space_without_the_observed_vector_is_refused() {
    let described = Liar {
        observation_space: BoxSpace::<f64>::unbounded(2).expect("small").into(),
        ..Liar::new()
    };
    let refusal = described.wrap(FrameStack::new(FRAMES)).map(drop);
    let error = SpaceError::MissingPart { key: "observation", element: "f32" };
    assert_eq!(refusal, Err(error.into()));
}

#[test]
fn snapshots_of_other_wrappers_are_refused_and_change_nothing() -> Result {
    let mut two = push()?.wrap(FrameStack::new(FRAMES.saturating_add(1)))?;
    let mut three = push()?.wrap(FrameStack::new(FRAMES))?;
    two.reset(Some(0))?;
    three.reset(Some(1))?;
    let before = three.snapshot();
    let refusal = three.restore(&two.snapshot());
    assert!(matches!(refusal, Err(EnvError::ForeignSnapshot { .. })), "{refusal:?}");
    assert_eq!(three.snapshot(), before);

    // Of the same environment, with fewer elements.
    let mut filtered =
        push()?.wrap(FilterObservation::new([0, 1]))?.wrap(NormalizeObservation::new())?;
    let mut more =
        push()?.wrap(FilterObservation::new([0, 1, 2]))?.wrap(NormalizeObservation::new())?;
    more.reset(Some(0))?;
    let before = filtered.snapshot();
    let refusal = filtered.restore(&more.snapshot());
    let of_elements = "its statistics have 3 elements, these have 2";
    assert!(refusal.is_err_and(|refusal| refusal.to_string().contains(of_elements)));
    assert_eq!(filtered.snapshot(), before);

    let mut reach = make_kinematic("FetchReach-v4")?.wrap(NormalizeObservation::new())?;
    let push = push()?.wrap(NormalizeObservation::new())?;
    let refusal = reach.restore(&push.snapshot());
    assert!(matches!(refusal, Err(EnvError::ForeignSnapshot { .. })), "{refusal:?}");
    Ok(())
}

#[test]
fn numbers_that_no_wrapper_can_have_are_refused_and_change_nothing() -> Result {
    fn refuse_each<E: SnapshotEnv<ActionSpace = BoxSpace<f32>>>(
        env: Result<E, EnvError>,
        numbers: &[f64],
    ) -> Result {
        let mut env = env?;
        env.reset(Some(0))?;
        for _ in 0..4 {
            env.step(&[0.3; 4])?;
        }
        let before = env.snapshot();
        for snapshot in with_each_number_replaced(&before, numbers, &[])? {
            let refusal = env.restore(&snapshot);
            assert!(matches!(refusal, Err(EnvError::ForeignSnapshot { .. })), "{refusal:?}");
            assert_eq!(env.snapshot(), before);
        }
        Ok(())
    }
    const BEYOND: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    refuse_each(push()?.wrap(FrameStack::new(FRAMES)), &[f64::NAN])?;
    refuse_each(push()?.wrap(DelayObservation::new(2)), &[f64::NAN])?;
    refuse_each(push()?.wrap(DelayAction::new(2)), &BEYOND)?;
    refuse_each(push()?.wrap(LowPassAction::new(0.5)), &BEYOND)?;
    refuse_each(push()?.wrap(NormalizeObservation::new()), &BEYOND)?;
    refuse_each(push()?.wrap(RecordEpisodeStatistics::new()), &BEYOND)
}

#[test]
fn the_longest_episode_does_not_overflow_its_length() -> Result {
    let mut env = push()?.wrap(RecordEpisodeStatistics::new())?;
    env.reset(Some(0))?;
    let mut snapshot = serde_json::to_value(env.snapshot())?;
    snapshot["wrapper"]["episode_length"] = u32::MAX.into();
    env.restore(&serde_json::from_value(snapshot)?)?;
    env.step(&[0.0; 4])?;
    assert_eq!(env.so_far().episode_length, u32::MAX);
    Ok(())
}

#[test]
fn the_largest_statistics_stay_finite() -> Result {
    let len = 25;
    for (mean, variance) in [(1e200, 1e290), (-1e200, 0.0), (1e140, 1e290), (0.9e140, 0.0)] {
        let json = format!(
            r#"{{"count":9007199254740992.0,"mean":{:?},"variance":{:?}}}"#,
            vec![mean; len],
            vec![variance; len]
        );
        let mut env = push()?.wrap(NormalizeObservation::frozen(serde_json::from_str(&json)?))?;
        env.set_frozen(false);
        env.reset(Some(0))?;
        for _ in 0..5 {
            env.step(&[0.3; 4])?;
            let statistics = serde_json::to_string(env.statistics())?;
            assert_eq!(serde_json::from_str::<RunningStatistics>(&statistics)?, *env.statistics());
        }
    }
    Ok(())
}

#[test]
fn damaged_statistics_are_refused() -> Result {
    let json = serde_json::to_string(&RunningStatistics::new(1))?;
    assert_eq!(json, r#"{"count":0.0001,"mean":[0.0],"variance":[1.0]}"#);
    assert_eq!(serde_json::from_str::<RunningStatistics>(&json)?, RunningStatistics::new(1));
    for json in [
        r#"{"count":0.0,"mean":[0.0],"variance":[1.0]}"#,
        r#"{"count":1.0,"mean":[0.0],"variance":[-1.0]}"#,
        r#"{"count":1.0,"mean":[0.0,1.0],"variance":[1.0]}"#,
        r#"{"count":1.0,"mean":[null],"variance":[1.0]}"#,
        r#"{"count":-1.0,"mean":[0.0],"variance":[1.0]}"#,
        r#"{"count":9007199254740994.0,"mean":[0.0],"variance":[1.0]}"#,
        r#"{"count":1.0,"mean":[1.1e200],"variance":[1.0]}"#,
        r#"{"count":1.0,"mean":[0.0],"variance":[1.1e290]}"#,
    ] {
        let read = serde_json::from_str::<RunningStatistics>(json);
        assert!(read.is_err(), "{json} gave {read:?}");
    }
    Ok(())
}

#[test]
fn after_an_observation_of_the_wrong_length_a_reset_is_needed() -> Result {
    let length = |actual| EnvError::ObservationLength { key: "observation", expected: 2, actual };
    let mut env = Liar::new().wrap(TimeAwareObservation::new(STEPS))?;
    env.reset(None)?;
    assert_eq!(env.step(&[0.0])?.observation.len(), 3);
    assert_eq!(env.step(&[1.0]), Err(length(1)));
    assert_eq!(env.step(&[0.0]), Err(EnvError::ResetNeeded));
    env.reset(None)?;
    assert_eq!(env.step(&[0.0])?.observation[2], 0.02, "the time starts again");

    let mut env = Liar { first: 3, ..Liar::new() }.wrap(FrameStack::new(FRAMES))?;
    assert_eq!(env.reset(None), Err(length(3)));
    assert_eq!(env.step(&[0.0]), Err(EnvError::ResetNeeded));
    Ok(())
}

/// A wrapper that lets the first reset pass, and then returns its error before or after it resets
/// the environment.
struct Failing {
    passes: u32,
    error: EnvError,
    resets_first: bool,
}

impl<E: Env> Wrapper<E> for Failing {
    type Observation = E::Observation;
    type Info = E::Info;
    type ActionSpace = E::ActionSpace;

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> std::result::Result<Reset<E::Observation, E::Info>, EnvError> {
        let fails = self.passes == 0;
        self.passes = self.passes.saturating_sub(1);
        if fails && !self.resets_first {
            return Err(self.error.clone());
        }
        let reset = env.reset_with(seed, options)?;
        if fails { Err(self.error.clone()) } else { Ok(reset) }
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> std::result::Result<Step<E::Observation, E::Info>, EnvError> {
        env.step(action)
    }

    fn action_space<'a>(&'a self, env: &'a E) -> &'a E::ActionSpace {
        env.action_space()
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        env.observation_space()
    }
}

fn any_errors() -> [EnvError; 5] {
    [
        EnvError::other("the camera is off"),
        EnvError::OptionOutside { option: "goal", index: 0, value: 2.0, most: 1.0 },
        EnvError::Entropy { reason: "none".into() },
        EnvError::EpisodeOver,
        EnvError::ActionLength { expected: 4, actual: 3 },
    ]
}

#[test]
fn a_wrapper_that_fails_after_the_reset_must_be_reset_again() -> Result {
    for error in any_errors() {
        let failing = Failing { passes: 1, error: error.clone(), resets_first: true };
        let failing = push()?.wrap(failing)?;
        // Wrappers and a time limit around it find out as well.
        let outer = failing.wrap(RecordEpisodeStatistics::new())?.wrap(FlattenObservation::new())?;
        let mut env = outer.wrap(TimeLimit::new(60.try_into()?))?;
        env.reset(Some(0))?;
        env.step(&[0.3; 4])?;
        assert_eq!(env.reset(Some(1)), Err(error));
        assert_eq!(env.step(&[0.3; 4]), Err(EnvError::ResetNeeded));
    }
    Ok(())
}

#[test]
fn a_reset_that_fails_before_it_begins_leaves_the_episode() -> Result {
    let mut plain = push()?;
    let expected = plain.reset(Some(0)).and_then(|_| plain.step(&[0.3; 4]))?;
    for error in any_errors() {
        let failing = Failing { passes: 1, error: error.clone(), resets_first: false };
        let mut env = push()?.wrap(failing)?;
        env.reset(Some(0))?;
        assert_eq!(env.reset(Some(1)), Err(error));
        assert_eq!(env.step(&[0.3; 4])?, expected);
    }
    let mut env =
        push()?.wrap(RecordEpisodeStatistics::new())?.wrap(TimeLimit::new(60.try_into()?))?;
    env.reset(Some(0))?;
    let options = FetchResetOptions::default().with_desired_goal([f64::NAN; 3]);
    let refusal = env.reset_with(None, &options);
    assert!(matches!(refusal, Err(EnvError::OptionOutside { .. })), "{refusal:?}");
    assert_eq!(env.step(&[0.3; 4])?.observation, expected.observation);
    Ok(())
}

#[test]
fn a_refused_action_changes_nothing() -> Result {
    let mut env = push()?.wrap(FrameStack::new(FRAMES))?.wrap(TimeAwareObservation::new(TWICE))?;
    env.reset(Some(0))?;
    let before = env.snapshot();
    for action in [&[0.0; 3][..], &[f32::NAN; 4]] {
        env.step(action).expect_err("an invalid action");
        assert_eq!(env.snapshot(), before);
    }
    env.step(&[0.0; 4])?;
    Ok(())
}

/// An environment whose observation has two elements as its space says, unless its action is 1.
struct Liar {
    first: usize,
    action_space: BoxSpace<f32>,
    observation_space: Space,
}

impl Liar {
    fn new() -> Self {
        let action_space = BoxSpace::uniform(vec![1], -1.0, 1.0).expect("an interval");
        Self {
            first: 2,
            action_space,
            observation_space: BoxSpace::<f32>::unbounded(2).expect("small").into(),
        }
    }
}

impl Env for Liar {
    type Observation = Vec<f32>;
    type Info = ();
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = ();

    fn reset_with(
        &mut self,
        _seed: Option<u64>,
        (): &(),
    ) -> std::result::Result<Reset<Vec<f32>, ()>, EnvError> {
        Ok(Reset { observation: vec![0.0; self.first], info: () })
    }

    fn step(&mut self, action: &[f32]) -> std::result::Result<Step<Vec<f32>, ()>, EnvError> {
        let observation = vec![0.0; if action == [1.0] { 1 } else { 2 }];
        Ok(Step { observation, reward: 0.0, terminated: false, truncated: false, info: () })
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        &self.action_space
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}
