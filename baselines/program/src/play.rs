//! `play`: writes a page that plays one episode back.

use std::path::PathBuf;

use baselines::Policy;
use baselines::page::{Document, Playback, PlaybackEnv};
use clap::ValueEnum;
use fetch_env::{
    AddRenderObservation, BoxSpace, Env, EnvExt, EnvId, FetchObservation, GoalObservation,
    PixelObservation,
};

use crate::shared::{
    choice::{PolicyChoice, pixel_policy_of, policy_of},
    env_id::parse_env_id,
    json::write_text,
    tasks::Tasks,
};

#[derive(clap::Args)]
pub struct Args {
    /// Environment, or auto for FetchReachDense-v4
    #[arg(long, default_value = "auto", value_parser = parse_env_id)]
    env_id: EnvId,
    /// Seed of the reset, and of the random policy
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Policy that acts: random, proportional (or proportional=GAIN), scripted, trained, robust,
    /// zero, or the file of a trained one
    #[arg(long, default_value = "scripted")]
    policy: String,
    /// Where to write the page
    #[arg(long, default_value = "results/playback.html")]
    out: PathBuf,
    /// Also print every step
    #[arg(long)]
    verbose: bool,
}

/// What a page says of the pictures that a policy sees.
const SEEN: &str = "The small picture is what the policy sees; the red pixels are the points to \
                    which its network reduces it.";

pub fn run(tasks: &impl Tasks, args: &Args) -> anyhow::Result<bool> {
    let (id, seed) = (args.env_id, args.seed);
    let mut env = tasks.make(id.config())?;
    let playback = if let Some(mut policy) = pixel_policy_of(&args.policy)? {
        let mut env = env.wrap(AddRenderObservation::new(policy.sight().pixels.clone()))?;
        let (observation, action) = (env.observation_space(), env.action_space().clone().into());
        policy.check_spaces(observation, &action)?;
        let [height, width] = policy.network().shape().picture_size();
        let mut seen = Vec::new();
        let mut acting = |observation: &PixelObservation<FetchObservation>, action: &mut [f32]| {
            policy.act(observation, action);
            seen.push(with_points(&observation.pixels, [width, height], policy.points()));
        };
        let playback = record(&mut env, &mut acting, args)?;
        playback.with_seen([width, height], seen, SEEN)?
    } else {
        let mut policy = policy_of(&args.policy, &env, seed)?;
        record(&mut env, &mut *policy, args)?
    };
    let title = format!("{id}, {} policy, seed {seed}", name(&args.policy));
    let playback = playback.with_title(&title);
    let mut page = Document::new(&title);
    page.push(&playback.html()?);
    write_text(&args.out, &page.html())?;
    say!("play: {title}: {}; wrote {}", playback.outcome(), args.out.display())?;
    Ok(true)
}

/// Records the episode, and prints its steps if the flags ask for it.
fn record<E: PlaybackEnv<ActionSpace = BoxSpace<f32>>>(
    env: &mut E,
    policy: &mut (impl Policy<E::Observation> + ?Sized),
    args: &Args,
) -> anyhow::Result<Playback> {
    if args.verbose {
        say!("  step   reward  distance  achieved goal            action")?;
    }
    let mut said = Ok(());
    let playback = Playback::record(env, policy, args.seed, |number, action, step| {
        if args.verbose && said.is_ok() {
            let info = step.info.as_ref();
            said = say!(
                "  {number:4}  {:7.3}  {:6.3} m  {:6.3?}  {action:5.2?}{}",
                step.reward,
                info.distance,
                step.observation.achieved_goal(),
                if info.is_success { "  reached" } else { "" },
            );
        }
    })?;
    said?;
    Ok(playback)
}

/// Returns a picture with a red pixel at each point: a column and a row.
fn with_points(
    picture: &[u8],
    [width, height]: [usize; 2],
    points: impl Iterator<Item = [f32; 2]>,
) -> Vec<u8> {
    let mut picture = picture.to_vec();
    for [column, row] in points {
        let place = |at: f32, len: usize| (at.round().max(0.0) as usize).min(len - 1);
        let at = 3 * (place(row, height) * width + place(column, width));
        picture[at..at + 3].copy_from_slice(&[255, 0, 0]);
    }
    picture
}

/// Returns the name of a policy in titles.
fn name(text: &str) -> &str {
    let is_name = PolicyChoice::from_str(text, false).is_ok() || text.starts_with("proportional=");
    if is_name { text } else { "trained" }
}
