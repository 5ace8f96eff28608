//! Writes one episode of the scripted or the trained policy as a clip:
//! `clip FetchPickAndPlace-v4 trained episode.gif [SEED [SIDE]]`, where SIDE is in pixels.
//!
//! A file name that ends in `.png` gets a lossless APNG, any other a GIF.

use std::{env, error::Error, fs::File, io::BufWriter};

use baselines::{Policy, ScriptedPolicy, TrainedPolicy};
use fetch_env::{Env, EnvId, RenderEnv, RenderOptions, clip::Clip, make};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [id, policy, path, rest @ ..] = arguments.as_slice() else {
        return Err("pass an environment, a policy and a file".into());
    };
    let id: EnvId = id.parse()?;
    let mut policy: Box<dyn Policy> = match policy.as_str() {
        "scripted" => Box::new(ScriptedPolicy::new(id.task)),
        "trained" => Box::new(TrainedPolicy::shipped(id.task)?),
        _ => return Err("the policy is `scripted` or `trained`".into()),
    };
    let seed = rest.first().map_or(Ok(0), |seed| seed.parse())?;

    let mut env = make(id)?;
    let side = rest.get(1).map_or(Ok(480), |side| side.parse())?;
    let options = RenderOptions::default().with_width(side).with_height(side);
    let mut clip = Clip::new(options.width(), options.height())?;
    let mut renderer = env.renderer(options)?;

    let start = env.reset(Some(seed))?;
    let (mut observation, mut action) = (start.observation, [0.0; 4]);
    clip.push_with_caption(env.render(&mut renderer)?, &caption(0, 0.0, start.info.distance))?;
    for elapsed in 1.. {
        policy.act(&observation, &mut action);
        let step = env.step(&action)?;
        let caption = caption(elapsed, step.reward, step.info.distance);
        clip.push_with_caption(env.render(&mut renderer)?, &caption)?;
        if step.is_last() {
            break;
        }
        observation = step.observation;
    }

    let file = BufWriter::new(File::create(path)?);
    if path.ends_with(".png") {
        clip.write_apng(file)?
    } else {
        clip.write_gif(file)?
    }
    Ok(())
}

fn caption(step: u32, reward: f64, distance: f64) -> String {
    let reward = reward + 0.0; // turns -0 into 0
    format!("step     {step:3}\nreward   {reward:6.3}\ndistance {distance:6.3} m")
}
