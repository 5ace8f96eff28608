//! `describe`: writes the spaces of an environment as JSON.

use std::path::{Path, PathBuf};

use fetch_env::{Env, GoalEnv, GoalObservation, make, observation_fields};
use serde_json::{Value, json};

use crate::shared::{
    env_id::StartArgs,
    json::{Versions, write_json},
};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    start: StartArgs,
    /// Where to write the description
    #[arg(long, value_name = "FILE", default_value = OUT)]
    describe_out: PathBuf,
}

/// Where the description goes unless a flag says otherwise.
pub(crate) const OUT: &str = "results/ch01_env_describe.json";

pub fn run(args: &Args) -> anyhow::Result<bool> {
    describe(args.start, &args.describe_out)
}

pub(crate) fn describe(start: StartArgs, out: &Path) -> anyhow::Result<bool> {
    let StartArgs { env_id: id, seed } = start;
    let mut env = make(id)?;
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
        "reward": {
            "kind": env.goal_reward().kind(),
            "distance_threshold": env.goal_reward().threshold(),
        },
        "max_episode_steps": id.config().max_episode_steps(),
        "versions": Versions::current(),
    });
    write_json(out, &description)?;
    say!(
        "describe: {id}: observation [{}], achieved_goal [{}], desired_goal [{}], action {:?}, \
         bounds [-1, 1]; wrote {}",
        first.observation().len(),
        first.achieved_goal().len(),
        first.desired_goal().len(),
        actions.shape(),
        out.display(),
    )?;
    Ok(true)
}
