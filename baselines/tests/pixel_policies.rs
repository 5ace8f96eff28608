//! Policies that see pictures: their actions, their files, and what is refused.

use std::error::Error as _;
use std::num::NonZeroU8;

use baselines::learn::network::{Convolution, PictureNetwork, PictureShape};
use baselines::{
    InputPart, PixelPolicy, PolicyError, PolicyHeader, SeenField, Sight, TrainedPolicy,
    TrainedPolicyError, evaluate, evaluate_vec,
};
use fetch_env::vec_env::{VecConfig, VecEnv};
use fetch_env::{
    AddRenderObservation, Camera, Env, EnvExt, PixelOptions, RenderEnv, RenderOptions, Task, make,
};
use her_relabel::{Normalizer, NormalizerConfig, StateRows};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use testing::{Result, unless_blind};

fn view() -> RenderOptions {
    RenderOptions::default().with_width(24).with_height(16).with_samples(0)
}

fn pixels() -> PixelOptions {
    PixelOptions::default().with_render(view())
}

fn header() -> PolicyHeader {
    PolicyHeader {
        version: PolicyHeader::VERSION,
        env_id: "FetchPush-v4".into(),
        observation_len: 25,
        goal_len: 3,
        action_len: 4,
        inputs: vec![InputPart::Observation, InputPart::DesiredGoal],
        observation_normalizer: None,
        goal_normalizer: None,
        algorithm: "by hand".into(),
        settings: Value::Null,
        seed: 0,
        steps: 0,
        demonstrations: 0,
        success: None,
    }
}

fn sight() -> Sight {
    Sight::robot(Task::Push, pixels())
}

fn network(size: [usize; 2], numbers: usize, outputs: usize) -> PictureNetwork {
    let convolutions = [
        Convolution { channels: 4, kernel: 5, stride: 4, padding: 2 },
        Convolution { channels: 3, kernel: 3, stride: 1, padding: 1 },
    ];
    let shape = PictureShape::new(size, &convolutions, numbers, &[8], outputs);
    PictureNetwork::init(shape.expect("it fits"), &mut ChaCha8Rng::seed_from_u64(0))
}

fn policy() -> PixelPolicy {
    PixelPolicy::new(header(), sight(), network([16, 24], 13, 4)).expect("it fits")
}

/// States of Push: rows of an observation and both goals, which differ in each element.
fn rows(count: usize) -> [Vec<f64>; 3] {
    let numbers = |len: usize, start: f64| (0..count * len).map(move |at| start + 0.01 * at as f64);
    [numbers(25, 0.1).collect(), numbers(3, 5.0).collect(), numbers(3, -1.0).collect()]
}

fn states(rows: &[Vec<f64>; 3]) -> StateRows<'_, f64, f64> {
    let [observation, achieved_goal, desired_goal] = rows;
    StateRows { observation, achieved_goal, desired_goal }
}

const PICTURE: usize = 16 * 24 * 3;

fn pictures(count: usize) -> Vec<u8> {
    (0..count * PICTURE).map(|at| (at * 7919 % 251) as u8).collect()
}

#[test]
fn a_policy_sees_the_picture_the_robot_and_the_goal_alone() -> Result {
    let names: Vec<_> = sight().fields.into_iter().map(|field| field.name).collect();
    assert_eq!(names, ["grip_pos", "gripper_state", "grip_velp", "gripper_vel"]);
    let (mut policy, pictures, rows) = (policy(), pictures(1), rows(1));
    let mut act = |pictures: &[u8], rows: &[Vec<f64>; 3]| -> Result<[f32; 4]> {
        let mut action = [0.0; 4];
        policy.act_rows(pictures, &states(rows), &mut action)?;
        Ok(action)
    };
    let action = act(&pictures, &rows)?;
    for (part, len) in [25, 3, 3].into_iter().enumerate() {
        for element in 0..len {
            let mut changed = rows.clone();
            changed[part][element] += 1.0;
            let is_seen = match part {
                0 => [0..3, 9..11, 20..25].iter().any(|field| field.contains(&element)),
                part => part == 2,
            };
            let is_other = act(&pictures, &changed)? != action;
            assert_eq!(is_other, is_seen, "element {element} of part {part}");
        }
    }
    let mut other = pictures;
    other[PICTURE / 2] ^= 255;
    assert_ne!(act(&other, &rows)?, action);
    Ok(())
}

#[test]
fn rows_have_the_actions_of_each_and_their_lengths_are_checked() -> Result {
    let (mut policy, pictures, rows) = (policy(), pictures(7), rows(7));
    let mut actions = [0.0; 7 * 4];
    policy.act_rows(&pictures, &states(&rows), &mut actions)?;
    for (row, expected) in actions.chunks_exact(4).enumerate() {
        let own = [25, 3, 3].iter().zip(&rows).map(|(len, all)| all[row * len..][..*len].to_vec());
        let own: Vec<_> = own.collect();
        let own = [own[0].clone(), own[1].clone(), own[2].clone()];
        let mut action = [0.0; 4];
        policy.act_rows(&pictures[row * PICTURE..][..PICTURE], &states(&own), &mut action)?;
        assert_eq!(action, expected);
    }
    let short = policy.act_rows(&pictures[1..], &states(&rows), &mut actions);
    assert!(matches!(short, Err(TrainedPolicyError::Rows { what: "bytes of pictures", .. })));
    let few = policy.act_rows(&pictures, &states(&rows), &mut actions[4..]);
    assert!(matches!(few, Err(TrainedPolicyError::Rows { .. })));
    let mut bad = rows;
    bad[0][25 + 4] = f64::NAN;
    let nan = policy.act_rows(&pictures, &states(&bad), &mut actions);
    assert!(matches!(nan, Err(TrainedPolicyError::StateNotFinite { row: 1, index: 4, .. })));
    Ok(())
}

#[test]
fn normalizers_are_those_of_whole_observations() -> Result {
    let mut normalizer = Normalizer::new(NormalizerConfig::new(25))?;
    normalizer.update(&rows(9)[0])?;
    let (rows, pictures) = (rows(1), pictures(1));
    let mut normalized = rows.clone();
    let mut numbers = [0.0_f32; 25];
    normalizer.normalize_into(&rows[0], &mut numbers)?;
    normalized[0] = numbers.iter().map(|number| f64::from(*number)).collect();
    let header = PolicyHeader { observation_normalizer: Some(normalizer), ..header() };
    let mut normalizing = PixelPolicy::new(header, sight(), network([16, 24], 13, 4))?;
    let [mut action, mut expected] = [[0.0; 4]; 2];
    normalizing.act_rows(&pictures, &states(&rows), &mut action)?;
    policy().act_rows(&pictures, &states(&normalized), &mut expected)?;
    assert_eq!(action, expected);
    Ok(())
}

fn can_see() -> Result<bool> {
    Ok(unless_blind(make("FetchReach-v4")?.renderer(view()))?.is_some())
}

#[test]
fn a_policy_acts_the_same_alone_among_many_and_loaded() -> Result {
    if !can_see()? {
        return Ok(());
    }
    let env = || make("FetchPush-v4")?.wrap(AddRenderObservation::new(pixels()));
    let (mut policy, mut alone) = (policy(), env()?);
    let expected = evaluate(&mut alone, &mut policy, 3, 0, |_| ())?;
    let envs = (0..2).map(|_| env()).collect::<Result<Vec<_>, _>>()?;
    let mut envs = VecEnv::new(envs, VecConfig::default())?;
    let bytes = policy.to_bytes()?;
    for _ in 0..8 {
        assert_eq!(policy.to_bytes()?, bytes);
    }
    let mut loaded = PixelPolicy::from_bytes(&bytes)?;
    assert_eq!(evaluate_vec(&mut envs, &mut loaded, 3, 0, |_| ())?, expected);
    let points: Vec<_> = loaded.points().collect();
    assert_eq!(points.len(), 2 * 3);
    let is_within = |[x, y]: &[f32; 2]| (0.0..24.0).contains(x) && (0.0..16.0).contains(y);
    assert!(points.iter().all(is_within), "{points:?}");
    Ok(())
}

#[test]
fn pictures_of_another_view_are_refused() -> Result {
    let check = |other: PixelOptions| policy().check_view(&other);
    check(pixels())?;
    let camera = Camera::Named("external_camera_0".into());
    for other in [
        pixels().with_render(view().with_camera(camera)),
        pixels().with_render(view().with_width(84)),
        pixels().with_render(view().with_goals_shown(false)),
        pixels().with_frame_stack(NonZeroU8::new(2).ok_or("not 0")?),
    ] {
        let error = check(other).expect_err("another view");
        assert!(matches!(error, PolicyError::View { .. }), "{error}");
        assert!(error.to_string().contains("its own pixel options"), "{error}");
    }
    if !can_see()? {
        return Ok(());
    }
    for (env_id, other) in [
        ("FetchPush-v4", pixels().with_render(view().with_width(20))),
        ("FetchPush-v4", pixels().with_channels_first(true)),
        ("FetchPush-v4", pixels().with_views([("scene", view())])),
        ("FetchReach-v4", pixels()),
    ] {
        let env = make(env_id)?.wrap(AddRenderObservation::new(other))?;
        let (observation, action) = (env.observation_space(), &env.action_space().clone().into());
        let error = policy().check_spaces(observation, action).expect_err("it does not fit");
        let is_picture = matches!(error, PolicyError::Picture { .. });
        assert_eq!(is_picture, env_id == "FetchPush-v4", "{error}");
    }
    Ok(())
}

#[test]
fn networks_that_do_not_fit_are_refused() {
    let refused = |header, sight, network| {
        let error = PixelPolicy::new(header, sight, network).expect_err("it does not fit");
        assert!(matches!(error, TrainedPolicyError::Sight { .. }), "{error}");
        error.to_string()
    };
    let whole = || network([16, 24], 13, 4);
    assert!(refused(header(), sight(), network([24, 16], 13, 4)).contains("[16, 24] rows"));
    assert!(refused(header(), sight(), network([16, 24], 12, 4)).contains("[13] numbers"));
    assert!(refused(header(), sight(), network([16, 24], 13, 3)).contains("[4] elements"));
    let beyond = SeenField { name: "beyond".into(), range: 24..26 };
    let beyond = Sight { fields: vec![beyond], ..sight() };
    assert!(refused(header(), beyond, whole()).contains("beyond is 24..26"));
    let stacked = NonZeroU8::new(2).map(|count| pixels().with_frame_stack(count));
    let stacked = Sight { pixels: stacked.expect("not 0"), ..sight() };
    assert!(refused(header(), stacked, whole()).contains("one frame"));
    let huge = PolicyHeader { goal_len: usize::MAX, ..header() };
    assert!(refused(huge, sight(), whole()).contains("an input has"));
    let mut diverged = whole();
    diverged.parameters_mut()[4 * 75 + 1] = f32::NAN;
    let error = PixelPolicy::new(header(), sight(), diverged).expect_err("it has diverged");
    assert!(error.to_string().contains("convolutions.0.bias has the number NaN at 1"), "{error}");
}

#[test]
fn files_are_loaded_whole_and_as_what_they_are() -> Result {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("policy.safetensors");
    policy().save(&path)?;
    assert!(PixelPolicy::load(&path)? == policy());
    let error = TrainedPolicy::load(&path).expect_err("it sees pictures");
    let reason = error.source().ok_or("it has no reason")?.to_string();
    assert_eq!(reason, "the policy sees pictures: load it as a PixelPolicy");
    let trained = TrainedPolicy::shipped(Task::Push)?.to_bytes()?;
    let error = PixelPolicy::from_bytes(&trained).expect_err("it sees no pictures");
    assert_eq!(error.to_string(), "the policy sees no pictures: load it as a TrainedPolicy");
    Ok(())
}

proptest! {
    /// A file that is cut off is refused, and one with a changed byte is refused or still a policy.
    #[test]
    fn a_cut_file_is_refused_and_a_changed_one_too_or_it_acts(
        cut in 0.0..1.0_f64,
        at in 0.0..1.0_f64,
        in_header in any::<bool>(),
        byte in any::<u8>(),
    ) {
        let bytes = policy().to_bytes().expect("it can be written");
        let place = |share: f64, len: usize| (share * len as f64) as usize;
        prop_assert!(PixelPolicy::from_bytes(&bytes[..place(cut, bytes.len())]).is_err());
        let mut changed = bytes.clone();
        changed[place(at, if in_header { 3_000 } else { bytes.len() })] = byte;
        if let Ok(mut policy) = PixelPolicy::from_bytes(&changed) {
            let len = policy.network().shape().picture_len();
            let rows = rows(1);
            let _ = policy.act_rows(&vec![9; len], &states(&rows), &mut [0.0; 4]);
            prop_assert!(policy.to_bytes().is_ok());
        }
    }
}
