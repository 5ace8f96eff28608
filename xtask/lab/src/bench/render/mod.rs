//! `bench render`: measures pictures per second, in wall time because software OpenGL uses all cores.

mod pictures;

use std::{path::PathBuf, sync::Arc, time::Duration};

use anyhow::Context;
use fetch_env::{Camera, EnvId, Renderer};
use goal_reward::RewardKind;
use serde::Serialize;

use self::pictures::{Format, Pictures, UP};
use super::{
    env::episodes::Episodes,
    interleaved::{Clock::Wall, Entry, interleave},
    peer::{Orders, Peer, note_other_mujoco},
    subject::{Subject, Subjects},
};
use crate::shared::{
    json::{Metric, write_results},
    python,
};

/// The format of the reference's pictures.
const LARGE: Format = Format { side: 480, samples: 4 };
const LARGE_HARD: Format = Format { side: 480, samples: 0 };
/// A usual format for policies.
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
    /// Also write the figures as JSON
    #[arg(long)]
    #[serde(skip)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Settings<'a> {
    #[serde(flatten)]
    args: &'a Args,
    opengl: &'static str,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    if args.peers {
        note_other_mujoco()?;
    }
    let mut figures = Vec::new();
    for subject in args.subjects.all() {
        for (name, figure) in measure(args, subject)? {
            let name = format!("render/{subject}/{name}");
            println!("{name:<80} {figure}");
            figures.push((name, figure));
        }
    }
    let opengl = opengl()?;
    println!("drawn with {opengl}");
    write_results(args.json.as_ref(), Settings { args, opengl }, figures)?;
    Ok(true)
}

fn measure(args: &Args, subject: Subject) -> anyhow::Result<Vec<(String, Metric)>> {
    let episodes = Episodes::new(subject.config()?)?;
    let entries = renderers(args, &episodes)?;
    let rounds = interleave(entries, Duration::from_secs(args.seconds.into()))?;
    let ratio = |to: &str, name: &str| {
        let value = rounds.ratio(Wall, &LARGE.to_string(), name)?;
        Some((format!("ratio/{LARGE}-to-{to}"), Metric::new(value, "1")))
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
            let pictures = peer(id, side)?;
            entries.push(Entry::new(&of_peer(side), UNIT, pictures));
        }
    }
    Ok(entries)
}

/// Starts an environment of gymnasium-robotics that draws square pictures with our OpenGL.
fn peer(id: EnvId, side: u32) -> anyhow::Result<Orders> {
    const SCRIPT: &str = include_str!("../../../scripts/pictures.py");
    let arguments = [id.to_string(), "--side".into(), side.to_string()];
    let gl = opengl()?.to_lowercase();
    let peer = Peer::start(&python::peers()?, ("pictures.py", SCRIPT), &arguments, &gl)?;
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
