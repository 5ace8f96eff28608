//! The effects of each wrapper.

use fetch_env::{
    BatchObservation, BoxSpace, Env, EnvError, EnvExt, FetchConfig, FetchEnv, GoalObservation,
    Info, KinematicSimulator, Reset, RewardKind, Space, Step, Task, make_kinematic,
    spaces::Value,
    wrappers::{
        ActionRepeat, ClipAction, FilterObservation, FlattenObservation, FrameStack,
        NormalizeObservation, RecordEpisodeStatistics, RescaleAction, SharedArray,
        TimeAwareObservation, TransformObservation,
    },
};
use proptest::prelude::*;

use super::{FRAMES, Result, STEPS, TWICE, push};

const ACTION: [f32; 4] = [0.5, -0.25, 0.75, 1.0];

fn rounded(part: &[f64]) -> Vec<f32> {
    part.iter().map(|&x| x as f32).collect()
}

#[test]
fn the_goal_follows_a_flat_observation_or_its_parts_have_gymnasiums_order() -> Result {
    let keys = ["achieved_goal", "desired_goal", "observation"];
    let mut env = push()?.wrap(FlattenObservation::with_keys(keys))?;
    let mut plain = push()?;
    let Space::BoxF32(space) = env.observation_space() else { panic!("not a box") };
    assert_eq!(space.shape(), [31]);
    let (flat, state) = (env.reset(Some(3))?.observation, plain.reset(Some(3))?.observation);
    // As in `gymnasium.spaces.flatten`: the keys of a dictionary are sorted.
    let parts = [state.achieved_goal(), state.desired_goal(), state.observation()].concat();
    assert_eq!(flat[..], rounded(&parts));

    let mut env = push()?.wrap(FlattenObservation::new())?;
    let flat = env.reset(Some(3))?.observation;
    assert_eq!(flat[..], rounded(&[state.observation(), state.desired_goal()].concat()));
    Ok(())
}

#[test]
fn a_flat_observation_has_parts_of_either_precision() -> Result {
    let mut normalized = push()?.wrap(NormalizeObservation::new())?;
    let mut env = push()?.wrap(NormalizeObservation::new())?.wrap(FlattenObservation::new())?;
    let state = normalized.reset(Some(3))?.observation;
    let flat = env.reset(Some(3))?.observation;
    assert_eq!(flat[..25], *state.observation());
    assert_eq!(flat[25..], rounded(state.desired_goal()));
    Ok(())
}

#[test]
fn a_filter_keeps_elements_in_the_given_order_and_the_goals() -> Result {
    let mut env = push()?.wrap(FilterObservation::new((22..25).chain([0])))?;
    let state = push()?.reset(Some(3))?.observation;
    let kept = env.reset(Some(3))?.observation;
    let whole = state.observation();
    assert_eq!(kept.observation(), [whole[22], whole[23], whole[24], whole[0]]);
    assert_eq!(kept.desired_goal(), state.desired_goal());
    assert_eq!(kept.original(), &state);
    let vector = env.observation_space().as_dict().and_then(|dict| dict.get("observation"));
    assert_eq!(vector, Some(&BoxSpace::<f64>::unbounded(4)?.into()));
    Ok(())
}

#[test]
fn an_episode_has_its_return_and_length() -> Result {
    let mut env = make_kinematic("FetchPushDense-v4")?.wrap(RecordEpisodeStatistics::new())?;
    for _ in 0..2 {
        assert_eq!(env.reset(Some(1))?.info.episode, None);
        let mut rewards = Vec::new();
        loop {
            let step = env.step(&ACTION)?;
            rewards.push(step.reward);
            assert_eq!(AsRef::<Info>::as_ref(&step.info).is_success, step.info.info.is_success);
            let Some(episode) = step.info.episode else { continue };
            assert!(step.is_last());
            assert_eq!(episode.episode_return, rewards.iter().sum::<f64>());
            assert_eq!(episode.episode_length, 50);
            let json = serde_json::to_value(episode)?;
            let episode_return = episode.episode_return;
            let expected =
                serde_json::json!({ "episode_return": episode_return, "episode_length": 50 });
            assert_eq!(json, expected);
            break;
        }
        assert_eq!(rewards.len(), 50);
    }
    env.reset(None)?;
    env.step(&ACTION)?;
    assert_eq!(env.so_far().episode_length, 1);
    Ok(())
}

#[test]
fn the_info_of_an_episode_is_that_of_its_environment() -> Result {
    for (threshold, is_success) in [(10.0, true), (1e-9, false)] {
        let config =
            FetchConfig::new(Task::Push, RewardKind::Sparse).with_distance_threshold(threshold)?;
        let simulator = KinematicSimulator::new(config.sim());
        let mut env = FetchEnv::new(config, simulator)?.wrap(RecordEpisodeStatistics::new())?;
        let info = env.reset(Some(0))?.info;
        let own: &Info = info.as_ref();
        assert_eq!((own.is_success, own.distance), (is_success, info.info.distance));
    }
    Ok(())
}

#[test]
fn normalized_observations_follow_the_mean_and_variance_so_far() -> Result {
    let mut env = push()?.wrap(NormalizeObservation::new())?;
    let mut plain = push()?;
    let mut seen: Vec<Vec<f64>> = Vec::new();
    for seed in 0..3 {
        let mut last = env.reset(Some(seed))?.observation;
        seen.push(plain.reset(Some(seed))?.observation.observation().to_vec());
        for _ in 0..50 {
            last = env.step(&ACTION)?.observation;
            seen.push(plain.step(&ACTION)?.observation.observation().to_vec());
        }
        let count = seen.len() as f64;
        for index in 0..25 {
            let column = || seen.iter().map(|vector| vector[index]);
            let mean = column().sum::<f64>() / count;
            let variance = column().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
            // The statistics begin with the weight of 0.0001 vectors.
            let ours = (env.statistics().mean()[index], env.statistics().variance()[index]);
            assert!((ours.0 - mean).abs() < 1e-5, "mean {index}: {ours:?} and {mean}");
            assert!((ours.1 - variance).abs() < 1e-4, "variance {index}: {ours:?} and {variance}");
            let newest = seen[seen.len() - 1][index];
            let normalized = ((newest - ours.0) / (ours.1 + 1e-8).sqrt()) as f32;
            assert_eq!(last.observation()[index], normalized);
        }
        let goals = plain.inner().observe()?;
        assert_eq!(last.achieved_goal(), goals.achieved_goal(), "goals stay");
    }
    env.set_frozen(true);
    let before = env.statistics().clone();
    env.reset(None)?;
    assert_eq!(env.statistics(), &before);
    assert!(env.is_frozen());
    env.set_frozen(false);
    env.reset(None)?;
    assert!(!env.is_frozen() && env.statistics() != &before);
    Ok(())
}

#[test]
fn the_first_steps_of_statistics_are_gymnasiums() -> Result {
    // gymnasium.wrappers.utils.RunningMeanStd of one element, after 1.0 and after 1.0, 3.0.
    let mut env = Echo { first: 1.0, ..Echo::new() }.wrap(NormalizeObservation::new())?;
    env.reset(None)?;
    let (none, one, two) = (1e-4, 1e-4 + 1.0, 1e-4 + 1.0 + 1.0);
    let mean = 1.0 / one;
    let variance = (1.0 * none + 1.0 * none / one) / one;
    assert_eq!(env.statistics().mean(), [mean]);
    assert_eq!(env.statistics().variance(), [variance]);
    env.step(&[3.0])?;
    let delta = 3.0 - mean;
    assert_eq!(env.statistics().mean(), [mean + delta / two]);
    assert_eq!(env.statistics().variance(), [(variance * one + delta * delta * one / two) / two]);
    assert_eq!(env.statistics().count(), two);
    Ok(())
}

#[test]
fn the_time_goes_from_zero_to_one_and_stays_there() -> Result {
    let mut env = push()?.into_inner().wrap(TimeAwareObservation::new(TWICE))?;
    for _ in 0..2 {
        assert_eq!(env.reset(Some(0))?.observation.observation()[25], 0.0);
        for time in [0.5, 1.0, 1.0] {
            assert_eq!(env.step(&ACTION)?.observation.observation()[25], time);
        }
    }
    Ok(())
}

#[test]
fn stacked_frames_begin_with_copies_of_the_first() -> Result {
    let mut env = push()?.wrap(FrameStack::new(FRAMES))?;
    let mut plain = push()?;
    let mut frames = vec![plain.reset(Some(4))?.observation.observation().to_vec(); 3];
    assert_eq!(env.reset(Some(4))?.observation.observation(), frames.concat());
    for _ in 0..5 {
        frames.remove(0);
        frames.push(plain.step(&ACTION)?.observation.observation().to_vec());
        assert_eq!(env.step(&ACTION)?.observation.observation(), frames.concat());
    }
    frames.fill(plain.reset(None)?.observation.observation().to_vec());
    assert_eq!(env.reset(None)?.observation.observation(), frames.concat());
    let vector = env.observation_space().as_dict().and_then(|dict| dict.get("observation"));
    let Some(Space::BoxF64(space)) = vector else { panic!("{vector:?}") };
    assert_eq!(space.shape(), [3, 25]);
    Ok(())
}

#[test]
fn a_repeated_action_sums_its_rewards_until_the_end() -> Result {
    let dense = || make_kinematic("FetchPushDense-v4");
    let three = TWICE.saturating_add(1);
    let mut env = dense()?.wrap(ActionRepeat::new(three))?;
    let mut plain = dense()?;
    env.reset(Some(2))?;
    plain.reset(Some(2))?;
    for repetition in 0..17 {
        let step = env.step(&ACTION)?;
        // 50 steps are 16 times three and two.
        let count = if repetition == 16 { 2 } else { 3 };
        let parts = (0..count).map(|_| plain.step(&ACTION)).collect::<Result<Vec<_>, _>>()?;
        assert_eq!(step.reward, parts.iter().map(|part| part.reward).sum::<f64>());
        assert_eq!(step.observation, parts[count - 1].observation);
        assert_eq!(step.is_last(), repetition == 16);
    }
    Ok(())
}

proptest! {
    #[test]
    fn rescaled_actions_are_mapped_linearly(low in -10.0..10.0_f32, width in 0.1..10.0_f32) {
        let high = low + width;
        let mut env = Echo::new().wrap(RescaleAction::new(low, high))?;
        env.reset(None)?;
        let mut act = |action: f32| env.step(&[action]).map(|step| step.observation[0]);
        prop_assert_eq!(act(low)?, -2.0);
        prop_assert_eq!(act(high)?, 6.0);
        prop_assert_eq!(act(low - 100.0)?, -2.0);
        prop_assert_eq!(act(f32::MAX)?, 6.0);
        let middle = act(0.5 * (low + high))?;
        prop_assert!((middle - 2.0).abs() < 1e-3, "{}", middle);
    }

    #[test]
    fn clipped_actions_reach_the_environment_within_its_bounds(action in -20.0..20.0_f32) {
        let mut env = Echo::new().wrap(ClipAction::new())?;
        env.reset(None)?;
        prop_assert_eq!(env.step(&[action])?.observation, [action.clamp(-2.0, 6.0)]);
    }
}

/// An environment without rewards and ends that observes the action it took, from -2 to 6.
struct Echo {
    first: f32,
    action_space: BoxSpace<f32>,
    observation_space: Space,
}

impl Echo {
    fn new() -> Self {
        let space = BoxSpace::uniform(vec![1], -2.0, 6.0).expect("an interval");
        Self { first: 0.0, observation_space: space.clone().into(), action_space: space }
    }
}

impl Env for Echo {
    type Observation = [f32; 1];
    type Info = ();
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = ();

    fn reset_with(&mut self, _seed: Option<u64>, (): &()) -> Result<Reset<[f32; 1], ()>, EnvError> {
        Ok(Reset { observation: [self.first], info: () })
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<[f32; 1], ()>, EnvError> {
        let observation = [action[0]];
        Ok(Step { observation, reward: 0.0, terminated: false, truncated: false, info: () })
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        &self.action_space
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}

#[test]
fn an_action_within_the_bounds_keeps_its_bits() -> Result {
    for (low, high, zero) in [(0.0, 6.0, -0.0_f32), (-2.0, -0.0, 0.0)] {
        let action_space = BoxSpace::uniform(vec![1], low, high)?;
        let mut env = Echo { action_space, ..Echo::new() }.wrap(ClipAction::new())?;
        env.reset(None)?;
        let taken = env.step(&[zero])?.observation[0];
        assert_eq!(taken.to_bits(), zero.to_bits(), "from {low} to {high}");
    }
    Ok(())
}

#[test]
fn a_transformed_environment_shows_its_wrapper() -> Result {
    let space = Echo::new().observation_space;
    let env = push()?.wrap(TransformObservation::new(space, |observation| observation))?;
    let shown = format!("{env:?}");
    assert!(shown.contains("wrapper: TransformObservation { .. }"), "{shown}");
    Ok(())
}

#[test]
fn arrays_show_their_elements() {
    let array = SharedArray::from(&[0.5, -1.0][..]);
    assert_eq!(format!("{array:?}"), "[0.5, -1.0]");
}

#[test]
fn wrapped_arrays_are_values_of_their_space() -> Result {
    let mut env =
        Echo::new().wrap(TimeAwareObservation::new(STEPS))?.wrap(FrameStack::new(FRAMES))?;
    env.reset(None)?;
    let value = env.step(&[4.0])?.observation.to_value(env.observation_space())?;
    assert_eq!(value, Value::F32(vec![0.0, 0.0, 0.0, 0.0, 4.0, 0.02]));
    assert!(env.observation_space().contains(&value));
    Ok(())
}
