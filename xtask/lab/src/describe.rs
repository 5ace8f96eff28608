//! `describe`: writes the spaces of an environment as JSON.

use std::path::PathBuf;

use fetch_env::{Env, EnvId, GoalEnv, GoalObservation, make_with_config, observation_fields};
use serde_json::{Value, json};

use crate::shared::{
    choice::EnvArgs,
    json::{Versions, write_json},
};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    env: EnvArgs,
    /// Where to write the description
    #[arg(long, default_value = "results/ch01_env_describe.json")]
    describe_out: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    describe(args.env.env_id, args.env.seed, &args.describe_out)
}

pub fn describe(id: EnvId, seed: u64, out: &std::path::Path) -> anyhow::Result<bool> {
    let mut env = make_with_config(id.config())?;
    let first = env.reset(Some(seed))?.observation;
    let part = |values: &[f64]| {
        json!({
            "shape": [values.len()], "dtype": "float64", "low": null, "high": null,
            "bounded": false, "after_reset": values,
        })
    };
    let fields: Vec<Value> = observation_fields(id.task)
        .iter()
        .map(|field| {
            json!({
                "name": field.name,
                "indices": [field.range.start, field.range.end - 1],
                "unit": field.unit,
                "meaning": field.description,
            })
        })
        .collect();
    let actions = env.action_space();
    let description = json!({
        "env_id": id,
        "seed": seed,
        "observation_space": {
            "observation": part(first.observation()),
            "achieved_goal": part(first.achieved_goal()),
            "desired_goal": part(first.desired_goal()),
        },
        "observation_fields": fields,
        "action_space": {
            "shape": actions.shape(), "dtype": "float32",
            "low": actions.low(), "high": actions.high(),
            "names": ["dx", "dy", "dz", "gripper (positive opens)"],
        },
        "reward": { "kind": env.goal_reward().kind(), "distance_threshold": env.goal_reward().threshold() },
        "max_episode_steps": id.config().max_episode_steps(),
        "versions": Versions::current(),
    });
    write_json(out, &description)?;
    say!(
        "describe: {id}: observation [{}], achieved_goal [{}], desired_goal [{}], action {:?}, bounds [-1, 1]; wrote {}",
        first.observation().len(),
        first.achieved_goal().len(),
        first.desired_goal().len(),
        actions.shape(),
        out.display(),
    )?;
    Ok(true)
}
