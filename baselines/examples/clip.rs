//! One episode of the scripted policy as a clip:
//! `clip FetchPickAndPlace-v4 episode.gif [SEED [SIDE]]`, where SIDE is in pixels.
//!
//! A file name that ends in `.png` gets a lossless APNG, any other a GIF.

use std::{env, error::Error, fs::File, io::BufWriter};

use baselines::{Policy, ScriptedPolicy};
use fetch_env::{
    Env, EnvId, RenderEnv, RenderOptions,
    clip::{Caption, Clip},
    make,
};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [id, path, rest @ ..] = arguments.as_slice() else {
        return Err("give an environment and a file".into());
    };
    let id: EnvId = id.parse()?;
    let seed = rest.first().map_or(Ok(0), |seed| seed.parse())?;

    let mut env = make(id)?;
    let side = rest.get(1).map_or(Ok(480), |side| side.parse())?;
    let options = RenderOptions::default().with_width(side).with_height(side);
    let mut clip = Clip::new(options.width(), options.height())?;
    let mut renderer = env.renderer(options)?;
    let mut policy = ScriptedPolicy::new(id.task);

    let start = env.reset(Some(seed))?;
    let (mut observation, mut action) = (start.observation, [0.0; 4]);
    let mut caption = Caption { step: 0, reward: 0.0, distance: start.info.distance };
    loop {
        clip.push_with_caption(env.render(&mut renderer)?, &caption)?;
        policy.act(&observation, &mut action);
        let step = env.step(&action)?;
        observation = step.observation;
        caption =
            Caption { step: caption.step + 1, reward: step.reward, distance: step.info.distance };
        if step.is_last() {
            break;
        }
    }
    clip.push_with_caption(env.render(&mut renderer)?, &caption)?;

    let file = BufWriter::new(File::create(path)?);
    if path.ends_with(".png") {
        clip.write_apng(file)?
    } else {
        clip.write_gif(file)?
    }
    Ok(())
}
