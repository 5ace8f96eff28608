//! Pictures of many environments leave no memory behind. The test has its own process, because it
//! measures the whole process.
#![cfg(all(feature = "render", target_os = "linux"))]

use std::{fs, num::NonZeroU8};

use fetch_env::vec_env::{VecConfig, VecEnv};
use fetch_env::{EnvExt, PixelOptions, PixelsOnly, RenderOptions, make};
use testing::{Result, unless_blind};

const NUM_ENVS: usize = 50;

/// Returns the resident memory of this process, in kB.
fn resident() -> Result<usize> {
    let status = fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find(|line| line.starts_with("VmRSS")).ok_or("no VmRSS")?;
    Ok(line.split_whitespace().nth(1).ok_or("no number")?.parse()?)
}

#[test]
fn many_pictures_leave_no_memory_behind() -> Result {
    let render = RenderOptions::default().with_width(20).with_height(15).with_samples(0);
    let options = PixelOptions::default()
        .with_render(render)
        .with_frame_stack(NonZeroU8::new(2).ok_or("not zero")?);
    let made: std::result::Result<Vec<_>, _> = (0..NUM_ENVS)
        .map(|_| make("FetchPush-v4")?.wrap(PixelsOnly::new(options.clone())))
        .collect();
    let Some(made) = unless_blind(made)? else { return Ok(()) };
    let mut envs = VecEnv::new(made, VecConfig::default().with_num_threads(2))?;
    envs.reset(Some(0))?;
    let actions = vec![0.2; 4 * NUM_ENVS];
    let mut run = |num_steps: usize| -> Result<usize> {
        for _ in 0..num_steps {
            assert_eq!(envs.step(&actions)?.errors().next(), None);
        }
        resident()
    };
    let before = run(60)?; // past the first reset
    let grown = run(60)?.saturating_sub(before);
    assert!(grown < 8_000, "{grown} kB more after 3000 pictures");
    Ok(())
}
