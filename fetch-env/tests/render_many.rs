//! Pictures of many environments. Without OpenGL the tests have nothing to do.
#![cfg(feature = "render")]

use std::num::NonZeroU8;

use fetch_env::spaces::SpaceError;
use fetch_env::vec_env::{AutoresetMode, VecConfig, VecEnv};
use fetch_env::wrappers::Wrapped;
use fetch_env::{
    AddRenderObservation, BatchObservation, Camera, Env, EnvError, EnvExt, FetchEnv,
    MujocoSimulator, PixelOptions, PixelsOnly, RenderEnv, RenderError, RenderOptions, SnapshotEnv,
    TimeLimit, View, check, make,
};
use testing::{Result, unless_blind};

fn can_see() -> Result<bool> {
    Ok(unless_blind(make("FetchReach-v4")?.renderer(tiny()))?.is_some())
}

fn tiny() -> RenderOptions {
    RenderOptions::default().with_width(20).with_height(15).with_samples(0)
}

fn options(frame_stack: u8) -> PixelOptions {
    PixelOptions::default()
        .with_render(tiny())
        .with_frame_stack(NonZeroU8::new(frame_stack).expect("at least one"))
        .with_channels_first(true)
}

/// The length of an episode, so that a few steps include ends.
const LIMIT: u32 = 3;
const NUM_ENVS: usize = 3;

type Short = Wrapped<FetchEnv<MujocoSimulator>, TimeLimit>;

fn short() -> std::result::Result<Short, EnvError> {
    let limit = LIMIT.try_into().expect("not 0");
    make("FetchPush-v4")?.into_inner().wrap(TimeLimit::new(limit))
}

fn with_pixels(stack: u8) -> std::result::Result<Wrapped<Short, AddRenderObservation>, EnvError> {
    short()?.wrap(AddRenderObservation::new(options(stack)))
}

fn action(env_id: usize, step: usize) -> [f32; 4] {
    let x = (env_id as f32 - 2.0) / 2.0;
    [x, if step.is_multiple_of(2) { 1.0 } else { -0.5 }, -x, 1.0]
}

fn actions(step: usize) -> Vec<f32> {
    (0..NUM_ENVS).flat_map(|env_id| action(env_id, step)).collect()
}

/// Returns what a single environment shows: the pictures of `num_rows` rows and those to which the
/// actions led, as a batch in this mode has them.
fn single(
    env_id: usize,
    stack: u8,
    mode: AutoresetMode,
    num_rows: usize,
) -> Result<Vec<[Vec<u8>; 2]>> {
    let mut env = with_pixels(stack)?;
    let first = env.reset(Some(7 + env_id as u64))?.observation.pixels.to_vec();
    let mut rows = vec![[first.clone(), first]];
    let mut is_over = false;
    for step in 0..num_rows {
        let reset = |env: &mut Wrapped<Short, AddRenderObservation>| -> Result<Vec<u8>> {
            Ok(env.reset(None)?.observation.pixels.to_vec())
        };
        if is_over && mode != AutoresetMode::SameStep {
            let first = reset(&mut env)?;
            rows.push([first.clone(), first]);
            is_over = false;
            continue;
        }
        let taken = env.step(&action(env_id, step))?;
        is_over = taken.is_last();
        let next = taken.observation.pixels.to_vec();
        let shown = if is_over && mode == AutoresetMode::SameStep {
            reset(&mut env)?
        } else {
            next.clone()
        };
        rows.push([shown, next]);
    }
    Ok(rows)
}

#[test]
fn many_environments_show_what_single_ones_do() -> Result {
    const NUM_STEPS: usize = 9;
    if !can_see()? {
        return Ok(());
    }
    for mode in [AutoresetMode::NextStep, AutoresetMode::SameStep, AutoresetMode::Disabled] {
        for stack in [1, 3] {
            let expected: Vec<_> = (0..NUM_ENVS)
                .map(|env_id| single(env_id, stack, mode, NUM_STEPS))
                .collect::<Result<_>>()?;
            for num_threads in [1, 2] {
                let config =
                    VecConfig::default().with_num_threads(num_threads).with_autoreset(mode);
                let made: std::result::Result<Vec<_>, _> =
                    (0..NUM_ENVS).map(|_| with_pixels(stack)).collect();
                let mut envs = VecEnv::new(made?, config)?;
                let made: std::result::Result<Vec<_>, _> =
                    (0..NUM_ENVS).map(|_| short()?.wrap(PixelsOnly::new(options(stack)))).collect();
                let mut alone = VecEnv::new(made?, config)?;
                let mut is_over = false;
                for step in 0..=NUM_STEPS {
                    let (batch, pictures) = if step == 0 {
                        (envs.reset(Some(7))?, alone.reset(Some(7))?)
                    } else if is_over && mode == AutoresetMode::Disabled {
                        (envs.reset(None)?, alone.reset(None)?)
                    } else {
                        let actions = actions(step - 1);
                        (envs.step(&actions)?, alone.step(&actions)?)
                    };
                    assert_eq!(batch.errors().next(), None);
                    is_over = batch.truncated()[0];
                    let len = 20 * 15 * 3 * usize::from(stack);
                    for (env_id, rows) in expected.iter().enumerate() {
                        let row = |pixels: &[u8]| pixels[env_id * len..][..len].to_vec();
                        let found = [row(batch.pixels()), row(batch.next_pixels())];
                        assert_eq!(rows[step], found, "{mode:?}, {env_id}, step {step}");
                        let found = [row(pictures.pixels()), row(pictures.next_pixels())];
                        assert_eq!(rows[step], found, "{mode:?}, {env_id}, step {step}");
                    }
                    assert_eq!(batch.pixels().len(), NUM_ENVS * len);
                    assert_eq!(batch.reward(), pictures.reward());
                }
            }
        }
    }
    Ok(())
}

#[test]
fn pictures_alone_keep_the_laws_and_so_do_snapshots() -> Result {
    if !can_see()? {
        return Ok(());
    }
    let check = check::CheckOptions::default();
    for stack in [1, 3] {
        // Large enough to show that goals differ.
        let large = || options(stack).with_render(tiny().with_width(84).with_height(84));
        let alone = || make("FetchPush-v4")?.wrap(PixelsOnly::new(large()));
        let report = check::check_env(alone, &check).and(check::check_snapshots(alone, &check));
        assert!(report.passed(), "{report}");
        let added = || make("FetchReach-v4")?.wrap(AddRenderObservation::new(options(stack)));
        let report = check::check_snapshots(added, &check);
        assert!(report.passed(), "{report}");
    }
    let snapshot = with_pixels(3)?.snapshot();
    let error = with_pixels(2)?.restore(&snapshot).unwrap_err();
    assert!(matches!(error, EnvError::ForeignSnapshot { .. }), "{error}");
    Ok(())
}

#[test]
fn an_environment_with_pixels_moves_between_threads() -> Result {
    if !can_see()? {
        return Ok(());
    }
    let mut stays = make("FetchSlide-v4")?.wrap(PixelsOnly::new(options(1)))?;
    let mut moves = make("FetchSlide-v4")?.wrap(PixelsOnly::new(options(1)))?;
    assert_eq!(stays.reset(Some(5))?, moves.reset(Some(5))?);
    for step in 0..4 {
        let taken = stays.step(&action(0, step))?;
        let thread = std::thread::spawn(move || {
            let taken = moves.step(&action(0, step));
            (moves, taken)
        });
        let (moved, other) = thread.join().expect("no panic");
        moves = moved;
        assert_eq!(taken, other?);
    }
    // The wrapper shows what it wraps, also through pointers.
    let mut renderer = stays.renderer(tiny())?;
    let picture = Box::new(&mut stays).render(&mut renderer)?.to_vec();
    assert_eq!(picture, stays.inner().render(&mut renderer)?);
    Ok(())
}

#[test]
fn a_camera_that_the_model_lacks_is_an_error_at_once() -> Result {
    if !can_see()? {
        return Ok(());
    }
    let camera = Camera::Named("none".into());
    let options = options(1).with_render(RenderOptions::default().with_camera(camera));
    let error = make("FetchReach-v4")?.wrap(PixelsOnly::new(options)).unwrap_err();
    assert!(matches!(error.downcast_ref(), Some(RenderError::UnknownCamera { .. })), "{error}");
    Ok(())
}

#[test]
fn several_views_show_what_each_shows_alone() -> Result {
    if !can_see()? {
        return Ok(());
    }
    let gripper = || Camera::Named("gripper_camera_rgb".into());
    let views = [
        ("scene", tiny()),
        ("gripper", tiny().with_camera(gripper()).with_goals_shown(false)),
        ("large", tiny().with_width(31).with_height(29).with_camera(gripper())),
    ];
    let several = |stack| AddRenderObservation::new(options(stack).with_views(views.clone()));
    let lawful = || make("FetchPush-v4")?.wrap(several(2));
    let report = check::check_snapshots(lawful, &check::CheckOptions::default());
    assert!(report.passed(), "{report}");
    let mut env = lawful()?;
    let observation = env.reset(Some(0))?.observation;
    assert!(env.observation_space().contains(&observation.to_value(env.observation_space())?));
    for stack in [1, 3] {
        let several = || short()?.wrap(several(stack));
        let many = (0..NUM_ENVS).map(|_| several()).collect::<std::result::Result<Vec<_>, _>>()?;
        let mut many = VecEnv::new(many, VecConfig::default().with_num_threads(2))?;
        many.reset(Some(7))?;
        for step in 0..LIMIT as usize {
            many.step(&actions(step))?;
        }
        for (key, view) in views.clone() {
            for env_id in 0..NUM_ENVS {
                let alone = options(stack).with_render(view.clone());
                let mut alone = short()?.wrap(AddRenderObservation::new(alone))?;
                let mut env = several()?;
                let seed = Some(7 + env_id as u64);
                let mut shown =
                    [alone.reset(seed)?, env.reset(seed)?].map(|reset| reset.observation);
                for step in 0..LIMIT as usize {
                    assert_eq!(shown[1].pixels.of(key), Some(&*shown[0].pixels), "{key}");
                    assert_eq!(shown[1].state, shown[0].state);
                    let action = action(env_id, step);
                    shown = [alone.step(&action)?, env.step(&action)?].map(|step| step.observation);
                }
                let [alone, _] = shown;
                let rows = many.last_step().pixels_of(key).ok_or("the view's rows")?;
                assert_eq!(
                    rows[env_id * alone.pixels.len()..][..alone.pixels.len()],
                    *alone.pixels
                );
            }
        }
        assert_eq!(many.last_step().pixels_of("none"), None);
    }
    let twice = options(1).with_views([("scene", tiny()), ("scene", tiny())]);
    let error = short()?.wrap(PixelsOnly::new(twice)).unwrap_err();
    assert_eq!(error, EnvError::from(SpaceError::DuplicateKey { key: "scene".into() }));
    Ok(())
}

#[test]
fn views_that_share_a_renderer_keep_what_each_shows() -> Result {
    if !can_see()? {
        return Ok(());
    }
    let mut env = make("FetchPush-v4")?;
    env.reset(Some(0))?;
    let large = tiny().with_width(96).with_height(96);
    let camera = Camera::Named("external_camera_0".into());
    let options = [large.clone(), large.clone().with_goals_shown(false), large.with_camera(camera)];
    let alone = |options: &RenderOptions| -> Result<Vec<u8>> {
        Ok(env.render(&mut env.renderer(options.clone())?)?.to_vec())
    };
    let alone = options.iter().map(alone).collect::<Result<Vec<_>>>()?;
    assert!(alone[0] != alone[1] && alone[0] != alone[2]);
    let views = options.map(|options| View::new(&env, options).expect("a view"));
    for _ in 0..2 {
        for (view, alone) in views.iter().zip(&alone) {
            let shown = view.draw(&env, |renderer| Ok(env.render(renderer)?.to_vec()))?;
            assert!(shown == *alone, "{:?}", view.options());
        }
    }
    Ok(())
}
