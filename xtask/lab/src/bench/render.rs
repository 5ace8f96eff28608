//! `bench render`: measures pictures per second, in wall time because software OpenGL uses all
//! cores.

use std::{fmt, sync::Arc, time::Duration};

use anyhow::Context;
use fetch_env::{Camera, Env, EnvId, FreeCamera, MujocoEnv, RenderEnv, RenderOptions, Renderer};
use goal_reward::RewardKind;
use nalgebra::Vector3;
use serde::Serialize;

use super::{
    Subject, Subjects,
    env::episodes::{Episodes, STEPS},
    interleaved::{Clock::Wall, Contender, Entry, Timed, interleave, time},
    peer::{Orders, Peer, note_other_mujoco},
};
use crate::shared::python;
use fetch_cli::shared::json::Metric;

/// The format of the reference's pictures.
const LARGE: Format = Format { side: 480, samples: 4 };
const LARGE_HARD: Format = Format { side: 480, samples: 0 };
/// A common format for policies.
const SMALL: Format = Format { side: 84, samples: 0 };

const PEER: &str = "gymnasium-robotics";
/// Samples of the peer's pictures, at any size.
const PEER_SAMPLES: u8 = 4;

/// Seconds of drawing in each turn.
const TURN: f64 = 0.1;

#[derive(Debug, clap::Args, Serialize)]
pub struct Args {
    #[command(flatten)]
    #[serde(flatten)]
    subjects: Subjects,
    /// Seconds for each task and model
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(..3600))]
    seconds: u16,
    /// Also measure gymnasium-robotics, in a Python environment in the cache
    #[arg(long)]
    peers: bool,
}

/// The settings, and the OpenGL library that drew the pictures.
#[derive(Serialize)]
pub struct Settings<'a> {
    #[serde(flatten)]
    args: &'a Args,
    opengl: &'static str,
}

impl<'a> Settings<'a> {
    pub fn new(args: &'a Args) -> anyhow::Result<Self> {
        Ok(Self { args, opengl: opengl()? })
    }
}

pub fn run(args: &Args) -> anyhow::Result<Vec<(String, Metric)>> {
    if args.peers {
        note_other_mujoco()?;
    }
    let mut figures = Vec::new();
    for subject in args.subjects.all() {
        for (name, figure) in measure(args, subject)? {
            let name = format!("render/{subject}/{name}");
            say!("{name:<80} {figure}")?;
            figures.push((name, figure));
        }
    }
    say!("drawn with {}", opengl()?)?;
    Ok(figures)
}

fn measure(args: &Args, subject: Subject) -> anyhow::Result<Vec<(String, Metric)>> {
    let episodes = Episodes::new(subject.config())?;
    let entries = renderers(args, &episodes)?;
    let rounds = interleave(entries, Duration::from_secs(args.seconds.into()))?;
    let ratio = |to: &str, name: &str| {
        rounds.ratio(&format!("ratio/{LARGE}-to-{to}"), Wall, &LARGE.to_string(), name)
    };
    let ratios = [ratio(PEER, &of_peer(LARGE.side)), ratio(&sky(), &sky())];
    Ok(rounds.figures().chain(ratios.into_iter().flatten()).collect())
}

fn renderers(args: &Args, episodes: &Arc<Episodes>) -> anyhow::Result<Vec<Entry>> {
    const UNIT: &str = "frames/s";
    let mut entries = Vec::new();
    for format in [LARGE, LARGE_HARD, SMALL] {
        let pictures = Pictures::new(episodes, format, Camera::default())?;
        entries.push(Entry::new(&format.to_string(), UNIT, pictures));
    }
    let pictures = Pictures::new(episodes, LARGE, Camera::Free(UP))?;
    entries.push(Entry::new(&sky(), UNIT, pictures));
    if args.peers {
        let id = EnvId { task: episodes.config.task(), reward: RewardKind::Sparse };
        for side in [LARGE.side, SMALL.side] {
            entries.push(Entry::new(&of_peer(side), UNIT, peer(id, side)?));
        }
    }
    Ok(entries)
}

/// Starts an environment of gymnasium-robotics that draws square pictures with our OpenGL.
fn peer(id: EnvId, side: u32) -> anyhow::Result<Orders> {
    const SCRIPT: &str = include_str!("../../scripts/pictures.py");
    let arguments = [id.to_string(), "--side".into(), side.to_string()];
    let gl = opengl()?.to_lowercase();
    let python = python::environment("python", &python::REFERENCE)?;
    let peer = Peer::start(&python, ("pictures.py", SCRIPT), &arguments, &gl)?;
    Ok(Orders::new(&peer, TURN.to_string()))
}

fn sky() -> String {
    format!("sky-{LARGE}")
}

fn of_peer(side: u32) -> String {
    format!("{PEER}-{}", Format { side, samples: PEER_SAMPLES })
}

/// Returns the library of OpenGL that draws the pictures.
fn opengl() -> anyhow::Result<&'static str> {
    Renderer::backend().context("a renderer was made")
}

/// A view straight up from above the robot, of only the sky: the least that OpenGL needs for a
/// picture. It still transforms the scene.
const UP: FreeCamera = FreeCamera {
    lookat: Vector3::new(1.3, 0.75, 20.0),
    distance: 10.0,
    elevation: 90.0,
    ..FreeCamera::REFERENCE
};

/// The format of a square picture.
#[derive(Clone, Copy)]
struct Format {
    side: u32,
    samples: u8,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { side, samples } = self;
        write!(f, "{side}x{side}-samples-{samples}")
    }
}

/// Pictures of an environment, each after a step that is not timed.
struct Pictures {
    episodes: Arc<Episodes>,
    env: MujocoEnv,
    renderer: Renderer,
    steps: usize,
}

impl Pictures {
    fn new(episodes: &Arc<Episodes>, format: Format, camera: Camera) -> anyhow::Result<Self> {
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
