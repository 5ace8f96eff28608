//! The contender that draws pictures of an environment.

use std::{fmt, sync::Arc};

use fetch_env::{Camera, Env, FreeCamera, MujocoEnv, RenderEnv, RenderOptions, Renderer};
use nalgebra::Vector3;

use super::TURN;
use crate::bench::{
    env::episodes::{Episodes, STEPS},
    interleaved::{Contender, Timed, time},
};

/// A view straight up from above the robot, of nothing but the sky: the least that OpenGL needs for a
/// picture. It still transforms the scene.
pub const UP: FreeCamera = FreeCamera::REFERENCE
    .with_lookat(Vector3::new(1.3, 0.75, 20.0))
    .with_distance(10.0)
    .with_elevation(90.0);

/// The format of a square picture.
#[derive(Clone, Copy)]
pub struct Format {
    pub side: u32,
    pub samples: u8,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { side, samples } = self;
        write!(f, "{side}x{side}-samples-{samples}")
    }
}

/// Pictures of an environment, each after a step that is not timed.
pub struct Pictures {
    episodes: Arc<Episodes>,
    env: MujocoEnv,
    renderer: Renderer,
    steps: usize,
}

impl Pictures {
    pub fn new(episodes: &Arc<Episodes>, format: Format, camera: Camera) -> anyhow::Result<Self> {
        let Format { side, samples } = format;
        let env = episodes.env()?;
        let options = RenderOptions::default().with_width(side).with_height(side);
        let renderer = env.renderer(options.with_samples(samples).with_camera(camera))?;
        Ok(Self { episodes: Arc::clone(episodes), env, renderer, steps: 0 })
    }

    fn step(&mut self) -> anyhow::Result<()> {
        let (episode, step) = (self.steps / STEPS, self.steps % STEPS);
        if step == 0 {
            self.env.reset(self.episodes.seed(episode))?;
        }
        self.env.step(&self.episodes.actions(episode)[step])?;
        self.steps += 1;
        Ok(())
    }
}

impl Contender for Pictures {
    fn work(&mut self) -> anyhow::Result<usize> {
        Ok(self.timed()?.done)
    }

    fn timed(&mut self) -> anyhow::Result<Timed> {
        let mut drawn = Timed::default();
        while drawn.wall < TURN {
            self.step()?;
            drawn += time(|| {
                self.env.render(&mut self.renderer)?;
                Ok(1)
            })?;
        }
        Ok(drawn)
    }
}
