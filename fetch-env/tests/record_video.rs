//! Recorded episodes, read back with decoders. Without OpenGL the tests have nothing to do.
#![cfg(all(feature = "clip", feature = "render"))]

use std::{fs, io::Cursor, num::NonZeroU32, path::Path};

use fetch_env::vec_env::{VecConfig, VecEnv};
use fetch_env::wrappers::Wrapped;
use fetch_env::{
    Env, EnvError, EnvExt, GoalEnvExt, MujocoEnv, PixelOptions, PixelsOnly, RecordVideo, RenderEnv,
    RenderOptions, SnapshotEnv, TimeLimit, VideoFormat, check, clip::ClipError, make,
};
use testing::{Result, unless_blind};

const ACTION: [f32; 4] = [1.0, -0.5, -1.0, 1.0];

fn small() -> RenderOptions {
    RenderOptions::default().with_width(48).with_height(36).with_samples(0)
}

fn video(folder: &Path) -> RecordVideo {
    RecordVideo::new(folder).with_render(small()).with_format(VideoFormat::Apng)
}

fn recorded(video: RecordVideo) -> Result<Option<Wrapped<MujocoEnv, RecordVideo>>> {
    Ok(unless_blind(make("FetchReach-v4")?.wrap(video))?)
}

fn clip_error<'a>(error: &'a (dyn std::error::Error + 'static)) -> Option<&'a ClipError> {
    error.downcast_ref::<EnvError>()?.downcast_ref()
}

/// Returns the sorted names of a folder's files.
fn files(folder: &Path) -> Result<Vec<String>> {
    let names = fs::read_dir(folder)?.map(|file| Ok(file?.file_name().to_string_lossy().into()));
    let mut names = names.collect::<Result<Vec<String>>>()?;
    names.sort();
    Ok(names)
}

fn num_frames(path: &Path) -> Result<u32> {
    let reader = png::Decoder::new(Cursor::new(fs::read(path)?)).read_info()?;
    Ok(reader.info().animation_control().map_or(1, |control| control.num_frames))
}

fn episode(env: &mut impl Env<ActionSpace = fetch_env::BoxSpace<f32>>) -> Result {
    env.reset(None)?;
    while !env.step(&ACTION)?.is_last() {}
    Ok(())
}

#[test]
fn chosen_episodes_are_written_at_their_end_and_steps_stay_the_same() -> Result {
    let folder = tempfile::tempdir()?;
    let inside = folder.path().join("a/b");
    let video = video(&inside).with_episodes(|episode| episode % 2 == 1);
    let Some(mut env) = recorded(video)? else { return Ok(()) };
    let mut plain = make("FetchReach-v4")?;
    let mut renderer = plain.renderer(small())?;
    let mut shown = Vec::new();
    assert_eq!(env.reset(Some(3))?, plain.reset(Some(3))?);
    for number in 0..3 {
        if number > 0 {
            assert_eq!(env.reset(None)?, plain.reset(None)?);
        }
        if number == 1 {
            shown.push(plain.render(&mut renderer)?.to_vec());
        }
        assert_eq!((env.num_episodes(), env.is_recording()), (number + 1, number == 1));
        loop {
            let step = env.step(&ACTION)?;
            assert_eq!(step, plain.step(&ACTION)?);
            if number == 1 {
                shown.push(plain.render(&mut renderer)?.to_vec());
            }
            if step.is_last() {
                break;
            }
        }
        assert!(!env.is_recording());
    }
    assert_eq!(files(&inside)?, ["rl-video-episode-1.png"]);
    assert_eq!(files(folder.path())?, ["a"]);
    let path = inside.join("rl-video-episode-1.png");
    assert_eq!(num_frames(&path)?, 51, "the first state and 50 steps");
    let mut clip = fetch_env::clip::Clip::new(48, 36)?;
    shown.iter().try_for_each(|frame| clip.push(frame))?;
    let mut expected = Vec::new();
    clip.write_apng(&mut expected)?;
    assert!(fs::read(path)? == expected, "another picture");
    Ok(())
}

#[test]
fn episodes_that_do_not_end_are_written_at_a_reset_by_request_or_when_full() -> Result {
    let folder = tempfile::tempdir()?;
    let settings = || video(folder.path()).with_episodes(|_| true);
    let Some(mut env) = recorded(settings().with_name_prefix("cut"))? else { return Ok(()) };
    env.reset(Some(0))?;
    env.step(&ACTION)?;
    assert!(env.step(&[f32::NAN; 4]).is_err());
    env.step(&ACTION)?;
    assert!(files(folder.path())?.is_empty());
    env.reset(None)?;
    assert_eq!(num_frames(&folder.path().join("cut-episode-0.png"))?, 3);
    env.step(&ACTION)?;
    env.finish()?;
    assert_eq!(num_frames(&folder.path().join("cut-episode-1.png"))?, 2);
    env.finish()?;
    env.step(&ACTION)?;
    env.reset(None)?;
    drop(env);
    assert_eq!(files(folder.path())?, ["cut-episode-0.png", "cut-episode-1.png"]);

    let full = settings().with_name_prefix("full").with_max_frames(NonZeroU32::new(7));
    // The limit is outside, so the recording notices the end only at the next reset.
    let inner = make("FetchReach-v4")?.into_inner();
    let mut env = inner.wrap(full)?.wrap(TimeLimit::new(9.try_into().expect("not 0")))?;
    episode(&mut env)?;
    assert_eq!(num_frames(&folder.path().join("full-episode-0.png"))?, 7);
    Ok(())
}

#[test]
fn the_default_episodes_are_gymnasiums() {
    let video = RecordVideo::new("videos");
    let chosen: Vec<u64> = (0..3001).filter(|&episode| video.records(episode)).collect();
    assert_eq!(chosen, [0, 1, 8, 27, 64, 125, 216, 343, 512, 729, 1000, 2000, 3000]);
    assert_eq!(video.path(8), Path::new("videos/rl-video-episode-8.gif"));
}

#[test]
fn a_restored_environment_records_from_the_next_reset_on() -> Result {
    let folder = tempfile::tempdir()?;
    let video = video(folder.path()).with_episodes(|_| true);
    let Some(mut env) = recorded(video)? else { return Ok(()) };
    env.reset(Some(0))?;
    env.step(&ACTION)?;
    let snapshot = env.snapshot();
    env.step(&ACTION)?;
    env.restore(&snapshot)?;
    assert!(!env.is_recording());
    while !env.step(&ACTION)?.is_last() {}
    assert!(files(folder.path())?.is_empty());
    episode(&mut env)?;
    assert_eq!(files(folder.path())?, ["rl-video-episode-1.png"]);
    // No program counts so far.
    let mut damaged = serde_json::to_value(&snapshot)?;
    damaged["wrapper"] = u64::MAX.into();
    let refused = env.restore(&serde_json::from_value(damaged)?);
    assert!(matches!(refused, Err(EnvError::ForeignSnapshot { .. })), "{refused:?}");
    Ok(())
}

#[test]
fn a_recorded_environment_keeps_the_laws() -> Result {
    let folder = tempfile::tempdir()?;
    let video =
        || video(folder.path()).with_format(VideoFormat::Gif).with_episodes(|number| number == 1);
    if recorded(video())?.is_none() {
        return Ok(());
    }
    let make = || make("FetchPush-v4")?.wrap(video());
    let check = check::CheckOptions::default();
    let report = check::check_goal_env(make, &check);
    assert!(report.passed(), "{report}");
    assert_eq!(files(folder.path())?, ["rl-video-episode-1.gif"]);
    assert_eq!(make()?.compute_reward(&[0.0; 3], &[0.0; 3])?, 0.0);
    Ok(())
}

#[test]
fn many_environments_record_and_show_pictures_at_the_same_time() -> Result {
    let folder = tempfile::tempdir()?;
    if recorded(video(folder.path()))?.is_none() {
        return Ok(());
    }
    let env = |index: usize| -> Result<_> {
        let pixels = make("FetchSlide-v4")?.wrap(PixelsOnly::new(PixelOptions::default()))?;
        let video = video(folder.path()).with_name_prefix(format!("env-{index}"));
        Ok(pixels.wrap(video)?)
    };
    let envs = (0..3).map(env).collect::<Result<Vec<_>>>()?;
    let mut envs = VecEnv::new(envs, VecConfig::default().with_num_threads(2))?;
    envs.reset(Some(0))?;
    for _ in 0..50 {
        assert_eq!(envs.step(&[0.3; 12])?.errors().next(), None);
    }
    let expected = [0, 1, 2].map(|index| format!("env-{index}-episode-0.png"));
    assert_eq!(files(folder.path())?, expected);
    Ok(())
}

#[cfg(unix)]
#[test]
fn files_beside_a_video_and_links_stay() -> Result {
    let folder = tempfile::tempdir()?;
    let of = |name: &str| folder.path().join(name);
    fs::write(of("thesis.txt"), "three years")?;
    std::os::unix::fs::symlink("thesis.txt", of("rl-video-episode-0.png.partial"))?;
    std::os::unix::fs::symlink("thesis.txt", of("rl-video-episode-1.png"))?;
    let Some(mut env) = recorded(video(folder.path()))? else { return Ok(()) };
    episode(&mut env)?;
    assert_eq!(num_frames(&of("rl-video-episode-0.png"))?, 51);
    let error = episode(&mut env).unwrap_err();
    assert!(matches!(clip_error(&*error), Some(ClipError::Video { .. })));
    assert_eq!(fs::read_to_string(of("thesis.txt"))?, "three years");
    let links = ["rl-video-episode-0.png.partial", "rl-video-episode-1.png"];
    for link in links {
        assert!(fs::symlink_metadata(of(link))?.is_symlink(), "{link}");
    }
    assert_eq!(files(folder.path())?.len(), links.len() + 2);
    Ok(())
}

#[test]
fn what_cannot_be_written_is_an_error() -> Result {
    let folder = tempfile::tempdir()?;
    if recorded(video(folder.path()))?.is_none() {
        return Ok(());
    }
    for name_prefix in ["../x", "a/b", "/x", "a\\b"] {
        let error = recorded(video(folder.path()).with_name_prefix(name_prefix)).unwrap_err();
        let Some(ClipError::NamePrefix { name_prefix: refused }) = clip_error(&*error) else {
            panic!("{error}");
        };
        assert_eq!(refused, name_prefix);
    }
    let file = folder.path().join("file");
    fs::write(&file, "no folder")?;
    let error = recorded(video(&file)).unwrap_err();
    assert!(matches!(clip_error(&*error), Some(ClipError::Video { .. })));
    // A folder has the name of the video.
    let gone = folder.path().join("rl-video-episode-0.png");
    fs::create_dir_all(gone.join("x"))?;
    let Some(mut env) = recorded(video(folder.path()))? else { return Ok(()) };
    env.reset(Some(0))?;
    for _ in 0..49 {
        env.step(&ACTION)?;
    }
    let error = env.step(&ACTION).unwrap_err();
    assert!(matches!(error.downcast_ref(), Some(ClipError::Video { path, .. }) if *path == gone));
    env.reset(None)?;
    assert_eq!(files(folder.path())?, ["file", "rl-video-episode-0.png"]);
    Ok(())
}
