//! Writes one episode of the scripted policy as a page that plays it back, with a plot of the
//! distance: `page FetchPush-v4 episode.html [SEED]`.

use std::{env, error::Error, fs};

use baselines::{
    ScriptedPolicy,
    page::{Axis, Document, Ink, Playback, Plot},
};
use fetch_env::{EnvId, make};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [id, path, rest @ ..] = arguments.as_slice() else {
        return Err("pass an environment and a file".into());
    };
    let id: EnvId = id.parse()?;
    let seed = rest.first().map_or(Ok(0), |seed| seed.parse())?;

    let mut distances = Vec::new();
    let mut policy = ScriptedPolicy::new(id.task);
    let watch = |step: usize, _: &_, outcome: &fetch_env::Step<_, fetch_env::Info>| {
        distances.push((step as f64, outcome.info.distance));
    };
    let playback = Playback::record(&mut make(id)?, &mut policy, seed, watch)?;

    let x = Axis::new("step", 0.0, playback.num_steps() as f64);
    let y = Axis::around("distance (m)", distances.iter().map(|point| point.1).chain([0.0]));
    let mut plot = Plot::new("Distance to the goal", x, y);
    plot.line(Ink::Blue, distances);

    let mut page = Document::new(playback.title());
    page.push(&playback.html()?);
    page.section("distance", "How it got there", &plot.svg()?);
    fs::write(path, page.html())?;
    Ok(())
}
