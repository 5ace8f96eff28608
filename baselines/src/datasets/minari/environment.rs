//! The environment of a data set, as Gymnasium describes it: its `EnvSpec` as JSON.

use fetch_env::{EnvId, RewardKind, Task};
use serde_json::{Value, json};

use crate::datasets::metadata::{Metadata, scene};

/// Returns the environment of the Python package, which `recover_environment()` makes.
pub(super) fn own_spec(metadata: &Metadata) -> Value {
    let Metadata { env_id, model, .. } = metadata;
    let kwargs = match *model {
        "builtin" => json!({ "env_id": env_id }),
        model => json!({ "env_id": env_id, "model": model }),
    };
    let classes = ["fetch_env:FetchEnv", "fetch_env:FetchVectorEnv"].map(Value::from);
    // Registered without, because the environment itself demands a reset first.
    let order_enforce = false;
    spec(metadata, &format!("fetch_env/{env_id}"), classes, order_enforce, kwargs)
}

/// Returns the environment of gymnasium-robotics, which `recover_environment(eval_env=True)` makes.
pub(super) fn robotics_spec(metadata: &Metadata) -> Value {
    let EnvId { task, reward } = metadata.env_id;
    let module = scene(task);
    let class = match task {
        Task::Reach => "MujocoFetchReachEnv",
        Task::Push => "MujocoFetchPushEnv",
        Task::PickAndPlace => "MujocoFetchPickAndPlaceEnv",
        Task::Slide => "MujocoFetchSlideEnv",
    };
    let classes = [format!("gymnasium_robotics.envs.fetch.{module}:{class}").into(), Value::Null];
    let reward = match reward {
        RewardKind::Sparse => "sparse",
        RewardKind::Dense => "dense",
    };
    spec(metadata, &metadata.env_id.to_string(), classes, true, json!({ "reward_type": reward }))
}

fn spec(
    metadata: &Metadata,
    id: &str,
    classes: [Value; 2],
    order_enforce: bool,
    kwargs: Value,
) -> Value {
    let [entry_point, vector_entry_point] = classes;
    json!({
        "id": id,
        "entry_point": entry_point,
        "reward_threshold": null,
        "nondeterministic": false,
        "max_episode_steps": metadata.max_episode_steps,
        "order_enforce": order_enforce,
        "disable_env_checker": false,
        "kwargs": kwargs,
        "additional_wrappers": [],
        "vector_entry_point": vector_entry_point,
    })
}
