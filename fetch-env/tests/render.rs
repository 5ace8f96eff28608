//! Rendering environments, and observing their pictures. Without OpenGL the tests have nothing to
//! do.
#![cfg(feature = "render")]

use std::num::NonZeroU8;

use allocation_counter::measure;
use fetch_env::spaces::{ImageSpace, SpaceError};
use fetch_env::variation::{LookFactor, Variation};
use fetch_env::vec_env::VecConfig;
use fetch_env::{
    AddRenderObservation, BatchObservation, BoxSpace, DictSpace, Env, EnvError, EnvExt, EnvId,
    FetchConfig, FetchObservation, FetchResetOptions, GoalEnvExt, GoalObservation, Info, MujocoEnv,
    PixelObservation, PixelOptions, RenderEnv, RenderError, RenderOptions, Renderer, Reset,
    RewardKind, SimConfig, SnapshotEnv, Space, Step, Task, VecEnv, check, make,
};
use testing::{Result, unless_blind};

fn small() -> RenderOptions {
    RenderOptions::default().with_width(40).with_height(30).with_samples(0)
}

fn renderer(env: &MujocoEnv) -> Result<Option<Renderer>> {
    Ok(unless_blind(env.renderer(small()))?)
}

fn options(frame_stack: u8, channels_first: bool) -> PixelOptions {
    let frame_stack = NonZeroU8::new(frame_stack).expect("at least one");
    PixelOptions::default()
        .with_render(small())
        .with_frame_stack(frame_stack)
        .with_channels_first(channels_first)
}

const ACTION: [f32; 4] = [1.0, -0.5, -1.0, 1.0];

#[test]
fn looking_changes_no_step() -> Result {
    for id in EnvId::ALL {
        let (mut seen, mut unseen) = (make(id)?, make(id)?);
        let Some(mut renderer) = renderer(&seen)? else { return Ok(()) };
        assert_eq!(seen.reset(Some(7))?, unseen.reset(Some(7))?);
        for _ in 0..50 {
            let before = seen.snapshot();
            seen.render(&mut renderer)?;
            seen.render_depth(&mut renderer)?;
            seen.render_segmentation(&mut renderer)?;
            assert_eq!(seen.snapshot(), before, "{id}");
            assert_eq!(seen.step(&ACTION)?, unseen.step(&ACTION)?, "{id}");
        }
    }
    Ok(())
}

#[test]
fn pictures_show_the_state_and_the_goal() -> Result {
    let mut env = make("FetchReach-v4")?;
    let Some(mut renderer) = renderer(&env)? else { return Ok(()) };
    assert!(matches!(env.render(&mut renderer), Err(EnvError::ResetNeeded)));
    let mut picture = |env: &MujocoEnv| env.render(&mut renderer).map(<[u8]>::to_vec);
    env.reset(Some(0))?;
    let start = picture(&env)?;
    assert_eq!(start.len(), 40 * 30 * 3);
    env.step(&ACTION)?;
    let snapshot = env.snapshot();
    let moved = picture(&env)?;
    assert_ne!(moved, start);
    env.reset(Some(1))?;
    assert_ne!(picture(&env)?, start, "another goal");
    env.restore(&snapshot)?;
    assert_eq!(picture(&env)?, moved);
    Ok(())
}

/// Returns the settings of Push with looks that are drawn from the seed.
fn with_looks() -> Result<FetchConfig> {
    let colors = [LookFactor::TABLE_COLOR, LookFactor::OBJECT_COLOR].concat();
    let variation = colors
        .into_iter()
        .try_fold(Variation::default(), |variation, factor| variation.with(factor, 0.0..=1.0))?
        .with("camera_pan", -5.0..=5.0)?
        .with("object_size", 0.8..=1.2)?;
    Ok(FetchConfig::new(Task::Push, RewardKind::Sparse).with_variation(variation))
}

#[test]
fn each_episode_has_its_looks_wherever_it_is_drawn() -> Result {
    let (mut varied, mut plain) = (make(with_looks()?)?, make("FetchPush-v4")?);
    let Some(mut renderer) = renderer(&varied)? else { return Ok(()) };
    let mut picture = |env: &MujocoEnv| env.render(&mut renderer).map(<[u8]>::to_vec);
    plain.reset(Some(5))?;
    let before = picture(&plain)?;
    varied.reset(Some(5))?;
    let drawn = picture(&varied)?;
    assert_ne!(drawn, before);
    assert_eq!(picture(&plain)?, before, "the renderer keeps no looks");
    plain.restore(&varied.snapshot())?;
    assert_eq!(picture(&plain)?, drawn, "a snapshot has the looks");
    varied.reset(None)?;
    assert_ne!(picture(&varied)?, drawn, "of another episode");

    let config = with_looks()?;
    let pixels = |_| make(config.clone())?.wrap(AddRenderObservation::new(options(1, false)));
    let envs = (0..3).map(pixels).collect::<std::result::Result<Vec<_>, _>>()?;
    let mut envs = VecEnv::new(envs, VecConfig::default().with_num_threads(2))?;
    let rows = envs.reset(Some(5))?.pixels().to_vec();
    for (seed, row) in (5..).zip(rows.chunks_exact(drawn.len())) {
        varied.reset(Some(seed))?;
        assert_eq!(row, picture(&varied)?, "the environment with seed {seed}");
    }
    Ok(())
}

#[test]
fn a_renderer_is_for_one_model() -> Result {
    let (reach, mut push) = (make("FetchReach-v4")?, make("FetchPush-v4")?);
    let Some(mut renderer) = renderer(&reach)? else { return Ok(()) };
    push.reset(Some(0))?;
    let error = push.render(&mut renderer).unwrap_err();
    assert!(matches!(error.downcast_ref(), Some(RenderError::OtherModel { .. })), "{error}");
    let mut dense = make("FetchReachDense-v4")?;
    dense.reset(Some(0))?;
    dense.render(&mut renderer)?;
    Ok(())
}

#[test]
fn pixels_are_what_render_shows_in_the_order_asked_for() -> Result {
    let mut plain = make("FetchPickAndPlace-v4")?;
    let Some(mut renderer) = renderer(&plain)? else { return Ok(()) };
    let with =
        |first| make("FetchPickAndPlace-v4")?.wrap(AddRenderObservation::new(options(2, first)));
    let mut last = with(false)?;
    let mut first = with(true)?;
    assert_eq!(options(2, false).space()?, ImageSpace::new([30, 40, 6])?.into());
    assert_eq!(options(2, true).space()?, ImageSpace::new([6, 30, 40])?.into());
    let start = plain.reset(Some(3))?.observation;
    let mut pictures = [0; 2].map(|_| plain.render(&mut renderer).expect("a picture").to_vec());
    let mut observations: [PixelObservation<_>; 2] =
        [&mut last, &mut first].map(|env| env.reset(Some(3)).expect("a reset").observation);
    assert_eq!(observations[0].state, start);
    for _ in 0..4 {
        let expected = |channels_first, row: usize, column: usize, frame: usize, color: usize| {
            let value = pictures[frame][(row * 40 + column) * 3 + color];
            let channel = 3 * frame + color;
            if channels_first {
                ((channel * 30 + row) * 40 + column, value)
            } else {
                ((row * 40 + column) * 6 + channel, value)
            }
        };
        for (channels_first, observation) in [false, true].into_iter().zip(&observations) {
            assert_eq!(observation.pixels.len(), 30 * 40 * 6);
            for at in 0..30 * 40 * 6 {
                let (row, column, rest) = (at / 240, at / 6 % 40, at % 6);
                let (index, value) = expected(channels_first, row, column, rest / 3, rest % 3);
                assert_eq!(observation.pixels[index], value, "{channels_first}, {index}");
            }
        }
        plain.step(&ACTION)?;
        pictures.rotate_left(1);
        pictures[1] = plain.render(&mut renderer)?.to_vec();
        observations =
            [&mut last, &mut first].map(|env| env.step(&ACTION).expect("a step").observation);
    }
    Ok(())
}

#[test]
fn an_environment_with_pixels_keeps_the_laws() -> Result {
    if renderer(&make("FetchPush-v4")?)?.is_none() {
        return Ok(());
    }
    let make = || make("FetchPush-v4")?.wrap(AddRenderObservation::new(options(1, true)));
    let report = check::check_goal_env(make, &check::CheckOptions::default());
    assert!(report.passed(), "{report}");
    let mut env = make()?;
    let observation = env.reset(Some(0))?.observation;
    assert!(env.observation_space().contains(&observation.to_value(env.observation_space())?));
    let Space::Dict(space) = env.observation_space() else { panic!("a dictionary") };
    assert_eq!(space.get("pixels"), Some(&options(1, true).space()?));
    let achieved = observation.achieved_goal();
    assert_eq!(env.compute_reward(achieved, achieved)?, 0.0);
    Ok(())
}

/// Has the key `pixels` in its observation space.
struct Taken {
    env: MujocoEnv,
    observation_space: Space,
}

impl Env for Taken {
    type Observation = FetchObservation;
    type Info = Info;
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = FetchResetOptions;

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &FetchResetOptions,
    ) -> std::result::Result<Reset<FetchObservation, Info>, EnvError> {
        self.env.reset_with(seed, options)
    }

    fn step(
        &mut self,
        action: &[f32],
    ) -> std::result::Result<Step<FetchObservation, Info>, EnvError> {
        self.env.step(action)
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        self.env.action_space()
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}

impl RenderEnv for Taken {
    fn sim_config(&self) -> &SimConfig {
        self.env.sim_config()
    }

    fn update_scene(&self, renderer: &mut Renderer) -> std::result::Result<(), EnvError> {
        self.env.update_scene(renderer)
    }
}

#[test]
fn a_second_key_named_pixels_is_an_error() -> Result {
    let observation_space = DictSpace::new([("pixels", BoxSpace::<f64>::unbounded(1)?.into())])?;
    let env = Taken { env: make("FetchReach-v4")?, observation_space: observation_space.into() };
    let error = env.wrap(AddRenderObservation::new(PixelOptions::default())).err();
    let expected = SpaceError::DuplicateKey { key: "pixels".into() };
    assert_eq!(error, Some(EnvError::from(expected)));
    Ok(())
}

#[test]
fn observing_pixels_allocates_nothing_once_observations_are_dropped() -> Result {
    let made = make("FetchPush-v4")?.wrap(AddRenderObservation::new(options(3, true)));
    let Some(mut env) = unless_blind(made)? else { return Ok(()) };
    let mut kept = vec![env.reset(Some(0))?.observation];
    let copy = kept[0].pixels.to_vec();
    for _ in 0..10 {
        kept.push(env.step(&ACTION)?.observation);
    }
    assert_eq!(*kept[0].pixels, copy, "a kept observation does not change");
    kept.clear();
    env.step(&ACTION)?;
    let counted = measure(|| {
        for _ in 0..10 {
            env.step(&ACTION).expect("a step");
        }
    });
    // OpenGL's driver allocates through C, which is not counted.
    assert_eq!(counted.count_total, 0, "{counted:?}");
    Ok(())
}
