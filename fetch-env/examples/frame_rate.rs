//! How many pictures a second can be rendered here: `frame_rate [SECONDS]`.
//!
//! Each row is one renderer of a Push environment that takes a step before every picture; steps are
//! not counted. Software OpenGL uses all cores by itself.

#![allow(clippy::print_stdout)]

use std::{env, error::Error, time::Duration, time::Instant};

use fetch_env::{
    Env, EnvId, FetchConfig, ModelSource, RenderEnv, RenderOptions, Renderer, make_config,
};

fn main() -> Result<(), Box<dyn Error>> {
    let seconds = env::args().nth(1).map_or(Ok(2.0), |seconds| seconds.parse())?;
    let id: EnvId = "FetchPush-v4".parse()?;
    for model in [ModelSource::Builtin, ModelSource::Reference] {
        let name = format!("{model:?}");
        let config = FetchConfig::builder(id.task).model(model).build()?;
        let mut env = match make_config(config) {
            Ok(env) => env,
            Err(error) => {
                println!("{name}: {error}");
                continue;
            }
        };
        for (side, samples) in [(480, 4), (480, 0), (84, 0)] {
            let options =
                RenderOptions { width: side, height: side, samples, ..RenderOptions::default() };
            let mut renderer = env.renderer(options)?;
            let mut shown = Duration::ZERO;
            let mut frames = 0;
            env.reset(Some(0))?;
            env.render(&mut renderer)?;
            while shown.as_secs_f64() < seconds {
                if env.step(&[0.3, -0.3, 0.1, 0.0])?.is_last() {
                    env.reset(None)?;
                }
                let start = Instant::now();
                env.render(&mut renderer)?;
                shown += start.elapsed();
                frames += 1;
            }
            let rate = f64::from(frames) / shown.as_secs_f64();
            println!(
                "{name}, {}: {side} x {side}, {samples} samples: {rate:.0} frames/s",
                Renderer::backend().unwrap_or("no OpenGL"),
            );
        }
    }
    Ok(())
}
