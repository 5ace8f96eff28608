//! Environments seen, and seeing themselves. Where there is no OpenGL there is nothing to look at.
#![cfg(feature = "render")]

use std::num::NonZeroU8;

use allocation_counter::measure;
use fetch_env::{
    AddRenderObservation, ChannelOrder, Env, EnvError, EnvId, GoalEnv, GoalObservation, MujocoEnv,
    PixelObservation, PixelOptions, RenderEnv, RenderError, RenderOptions, Renderer, SnapshotEnv,
    Space, check, make,
};

/// `None` where pictures cannot be made, and need not be.
fn unless_blind<T>(made: Result<T, EnvError>) -> Option<T> {
    match made {
        Err(EnvError::Render(RenderError::NoOpenGl { .. }))
            if std::env::var_os("MUJOCO_GL").is_none() =>
        {
            None
        }
        made => Some(made.expect("OpenGL")),
    }
}

fn env(id: &str) -> MujocoEnv {
    make(id).expect("MuJoCo")
}

fn small() -> RenderOptions {
    RenderOptions::default().with_width(40).with_height(30).with_samples(0)
}

fn renderer(env: &MujocoEnv) -> Option<Renderer> {
    unless_blind(env.renderer(small()))
}

fn options(frame_stack: u8, channel_order: ChannelOrder) -> PixelOptions {
    let frame_stack = NonZeroU8::new(frame_stack).expect("at least one");
    PixelOptions { render: small(), frame_stack, channel_order }
}

const ACTION: [f32; 4] = [1.0, -0.5, -1.0, 1.0];

#[test]
fn looking_changes_no_step() {
    for id in EnvId::ALL {
        let (mut seen, mut unseen) = (env(&id.to_string()), env(&id.to_string()));
        let Some(mut renderer) = renderer(&seen) else { return };
        assert_eq!(seen.reset(Some(7)).unwrap(), unseen.reset(Some(7)).unwrap());
        for _ in 0..50 {
            let before = seen.snapshot();
            seen.render(&mut renderer).unwrap();
            seen.render_depth(&mut renderer).unwrap();
            seen.render_segmentation(&mut renderer).unwrap();
            assert_eq!(seen.snapshot(), before, "{id}");
            assert_eq!(seen.step(&ACTION).unwrap(), unseen.step(&ACTION).unwrap(), "{id}");
        }
    }
}

#[test]
fn pictures_show_the_state_and_the_goal() {
    let mut env = env("FetchReach-v4");
    let Some(mut renderer) = renderer(&env) else { return };
    assert!(matches!(env.render(&mut renderer), Err(EnvError::ResetNeeded)));
    let mut picture = |env: &MujocoEnv| env.render(&mut renderer).unwrap().to_vec();
    env.reset(Some(0)).unwrap();
    let start = picture(&env);
    assert_eq!(start.len(), 40 * 30 * 3);
    env.step(&ACTION).unwrap();
    let snapshot = env.snapshot();
    let moved = picture(&env);
    assert_ne!(moved, start);
    env.reset(Some(1)).unwrap();
    assert_ne!(picture(&env), start, "another goal");
    env.restore(&snapshot).unwrap();
    assert_eq!(picture(&env), moved);
}

#[test]
fn a_renderer_is_for_one_model() {
    let (reach, mut push) = (env("FetchReach-v4"), env("FetchPush-v4"));
    let Some(mut renderer) = renderer(&reach) else { return };
    push.reset(Some(0)).unwrap();
    let error = push.render(&mut renderer).unwrap_err();
    assert!(matches!(error, EnvError::Render(RenderError::OtherModel { .. })), "{error}");
    let mut dense = env("FetchReachDense-v4");
    dense.reset(Some(0)).unwrap();
    dense.render(&mut renderer).unwrap();
}

#[test]
fn pixels_are_what_render_shows_in_the_order_asked_for() {
    let mut plain = env("FetchPickAndPlace-v4");
    let Some(mut renderer) = renderer(&plain) else { return };
    let with = |order| AddRenderObservation::new(env("FetchPickAndPlace-v4"), options(2, order));
    let mut last = with(ChannelOrder::Hwc).unwrap();
    let mut first = with(ChannelOrder::Chw).unwrap();
    assert_eq!(last.image_space().shape(), [30, 40, 6]);
    assert_eq!(first.image_space().shape(), [6, 30, 40]);
    let start = plain.reset(Some(3)).unwrap().observation;
    let mut pictures = [0; 2].map(|_| plain.render(&mut renderer).unwrap().to_vec());
    let mut observations: [PixelObservation<_>; 2] =
        [&mut last, &mut first].map(|env| env.reset(Some(3)).unwrap().observation);
    assert_eq!(observations[0].state, start);
    for _ in 0..4 {
        let expected = |order, row: usize, column: usize, frame: usize, color: usize| {
            let value = pictures[frame][(row * 40 + column) * 3 + color];
            let channel = 3 * frame + color;
            match order {
                ChannelOrder::Hwc => ((row * 40 + column) * 6 + channel, value),
                ChannelOrder::Chw => ((channel * 30 + row) * 40 + column, value),
            }
        };
        for (order, observation) in
            [ChannelOrder::Hwc, ChannelOrder::Chw].into_iter().zip(&observations)
        {
            assert_eq!(observation.pixels.len(), 30 * 40 * 6);
            for at in 0..30 * 40 * 6 {
                let (row, column, rest) = (at / 240, at / 6 % 40, at % 6);
                let (index, value) = expected(order, row, column, rest / 3, rest % 3);
                assert_eq!(observation.pixels[index], value, "{order:?}, {index}");
            }
        }
        plain.step(&ACTION).unwrap();
        pictures.rotate_left(1);
        pictures[1] = plain.render(&mut renderer).unwrap().to_vec();
        observations = [&mut last, &mut first].map(|env| env.step(&ACTION).unwrap().observation);
    }
}

#[test]
fn an_environment_with_pixels_keeps_the_laws() {
    if renderer(&env("FetchPush-v4")).is_none() {
        return;
    }
    let make = || AddRenderObservation::new(env("FetchPush-v4"), options(1, ChannelOrder::Chw));
    let report = check::check_env(make, &check::CheckOptions { steps: 60, ..Default::default() });
    assert!(report.passed(), "{report}");
    let mut env = make().unwrap();
    let observation = env.reset(Some(0)).unwrap().observation;
    assert!(env.observation_space().contains(&observation.to_value()));
    let Space::Dict(space) = env.observation_space() else { panic!("a dictionary") };
    assert_eq!(space.get("pixels"), Some(&Space::Image(env.image_space())));
    let achieved = observation.achieved_goal();
    assert_eq!(env.compute_reward(achieved, achieved).unwrap(), 0.0);
}

#[test]
fn observing_pixels_allocates_nothing_once_observations_are_dropped() {
    let made = AddRenderObservation::new(env("FetchPush-v4"), options(3, ChannelOrder::Chw));
    let Some(mut env) = unless_blind(made) else { return };
    let mut kept = vec![env.reset(Some(0)).unwrap().observation];
    let copy = kept[0].pixels.to_vec();
    kept.extend((0..10).map(|_| env.step(&ACTION).unwrap().observation));
    assert_eq!(*kept[0].pixels, copy, "what is kept stays as it was");
    kept.clear();
    env.step(&ACTION).unwrap();
    let counted = measure(|| {
        for _ in 0..10 {
            env.step(&ACTION).unwrap();
        }
    });
    // The driver of OpenGL allocates through C, which is not counted.
    assert_eq!(counted.count_total, 0, "{counted:?}");
}
