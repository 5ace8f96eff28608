//! Pictures a second beside stepping, as a small policy sees them: `cargo bench -p fetch-env --bench pictures`.
//!
//! Each line is the best of many short parts, because others may use the machine.

#![expect(clippy::print_stdout, reason = "it has no other result")]

use std::time::Instant;

use fetch_env::vec_env::{VecConfig, VecEnv};
use fetch_env::{
    AddRenderObservation, Camera, Env, EnvError, EnvExt, FreeCamera, PixelOptions, RenderEnv,
    RenderOptions, View, make,
};
use nalgebra::Vector3;

const NUM_ENVS: usize = 16;
const LEN: usize = 64 * 64 * 3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let lookat = Vector3::new(1.34, 0.75, 0.42);
    let camera = FreeCamera { lookat, distance: 0.9, azimuth: 132.0, elevation: -40.0 };
    let options = RenderOptions::default()
        .with_width(64)
        .with_height(64)
        .with_samples(0)
        .with_goals_shown(false)
        .with_camera(Camera::Free(camera));
    let actions = [0.3_f32, -0.2, 0.1, 0.5].repeat(NUM_ENVS);
    let push = || make("FetchPush-v4").map_err(EnvError::from);
    for threads in [1, 2] {
        let config = VecConfig::default().with_num_threads(threads);
        let pixels =
            || AddRenderObservation::new(PixelOptions::default().with_render(options.clone()));
        let mut envs = vec_env(|| push()?.wrap(pixels()), config)?;
        let rate = best_rate(|| {
            envs.step(&actions)?;
            Ok(())
        })?;
        println!("observed, on {threads} threads: {rate:.0} a second");

        let mut envs = vec_env(push, config)?;
        let view = View::new(envs.env(0).expect("idle"), options.clone())?;
        let mut pictures = vec![0; NUM_ENVS * LEN];
        let rate = best_rate(|| {
            envs.step(&actions)?;
            for (index, picture) in pictures.chunks_exact_mut(LEN).enumerate() {
                let env = envs.env(index).expect("idle");
                view.draw(env, |renderer| {
                    picture.copy_from_slice(env.render(renderer)?);
                    Ok(())
                })?;
            }
            Ok(())
        })?;
        println!("drawn by the caller, after steps on {threads} threads: {rate:.0} a second");
    }
    Ok(())
}

/// Makes environments and begins their episodes.
fn vec_env<E>(
    make: impl Fn() -> Result<E, EnvError>,
    config: VecConfig,
) -> Result<VecEnv<E>, Box<dyn std::error::Error>>
where
    E: Env<Observation: fetch_env::vec_env::BatchObservation> + Send + 'static,
{
    let envs = (0..NUM_ENVS).map(|_| make()).collect::<Result<Vec<_>, _>>()?;
    let mut envs = VecEnv::new(envs, config)?;
    envs.reset(Some(0))?;
    Ok(envs)
}

/// Returns the most pictures a second that `round`, which draws one of each environment, reaches.
fn best_rate(
    mut round: impl FnMut() -> Result<(), Box<dyn std::error::Error>>,
) -> Result<f64, Box<dyn std::error::Error>> {
    let mut best = f64::INFINITY;
    for _ in 0..30 {
        let start = Instant::now();
        (0..20).try_for_each(|_| round())?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok((20 * NUM_ENVS) as f64 / best)
}
