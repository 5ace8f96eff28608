//! `doctor`: the troubles of section 2.10, each looked for, with its fix.

use std::path::PathBuf;

use baselines::{Policy, RandomPolicy};
use fetch_env::{
    Env, EnvError, EnvId, FetchObservation, GoalEnv, GoalEnvExt, GoalObservation, MujocoEnv, Space,
    make,
};
use fetch_sim::MujocoVersion;

use serde::Serialize;

use crate::{
    random_episodes::evaluate_random,
    report::{Figure, Report, write_json},
};

#[derive(clap::Args)]
pub struct Args {
    /// Seed of resets and actions
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Also write what was found as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Settings {
    seed: u64,
}

/// What was found: nothing to worry about, or not.
struct Finding {
    healthy: bool,
    seen: String,
}

/// A trouble, how to look for it, and what to do about it.
struct Symptom {
    name: &'static str,
    look: fn(u64) -> Result<Finding, EnvError>,
    fix: &'static str,
}

const SYMPTOMS: [Symptom; 12] = [
    Symptom {
        name: "MuJoCo is missing, or not the one of the build",
        look: library,
        fix: "apt-get update && apt-get install -y libmujoco-dev, or set MUJOCO_DIR; then cargo clean -p fetch-sim",
    },
    Symptom {
        name: "obs is a flat array, not a dictionary",
        look: dictionary,
        fix: "flatten in the policy, not in the environment: hindsight needs the three parts",
    },
    Symptom {
        name: "obs[\"observation\"] shape is not (10,) for FetchReach",
        look: reach_shape,
        fix: "check the environment id: tasks with an object observe 25 numbers",
    },
    Symptom {
        name: "compute_reward is not to be had through a wrapper",
        look: wrapped_compute_reward,
        fix: "implement GoalEnv for the wrapper, passing goal_reward() through, as TimeLimit does",
    },
    Symptom {
        name: "step reward and compute_reward disagree",
        look: reward_law,
        fix: "a wrapper that changes rewards must change its goal_reward() too",
    },
    Symptom {
        name: "desired_goal is identical across resets",
        look: goals_differ,
        fix: "pass another seed to each reset, or none after the first",
    },
    Symptom {
        name: "achieved_goal does not match obs[\"observation\"][:3] for FetchPush",
        look: push_achieves_the_object,
        fix: "nothing: where there is an object, achieved_goal is its position, obs[3..6]",
    },
    Symptom {
        name: "FetchReachDense-v4 is not found",
        look: dense_is_registered,
        fix: "use one of the eight ids that the error names",
    },
    Symptom {
        name: "random success rate much higher than 0.1",
        look: random_success,
        fix: "check the distance threshold (0.05 m) and the target range of the configuration",
    },
    Symptom {
        name: "is_success is true immediately after reset",
        look: success_after_reset,
        fix: "nothing where it is rare: a goal may lie at the start. If it is not, check the seeds",
    },
    Symptom {
        name: "workspace bounds look wrong",
        look: workspace,
        fix: "check the model: the gripper starts at [1.34, 0.75, 0.53] in Reach",
    },
    Symptom {
        name: "actions that are no numbers are taken",
        look: bad_actions,
        fix: "check what the policy puts out: it has diverged",
    },
];

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let mut healthy = true;
    let mut results = Vec::new();
    for symptom in &SYMPTOMS {
        let finding = (symptom.look)(args.seed)
            .unwrap_or_else(|error| Finding { healthy: false, seen: error.to_string() });
        let mark = if finding.healthy { "ok  " } else { "FAIL" };
        println!("{mark}  {}\n      {}", symptom.name, finding.seen);
        if !finding.healthy {
            println!("      fix: {}", symptom.fix);
        }
        healthy &= finding.healthy;
        let faults = Figure::count(usize::from(!finding.healthy));
        results.push((format!("doctor/{}", symptom.name.replace(' ', "-")), faults));
    }
    if let Some(path) = &args.json {
        write_json(path, &Report::new(Settings { seed: args.seed }, results))?;
    }
    Ok(healthy)
}

fn library(_seed: u64) -> Result<Finding, EnvError> {
    let version = MujocoVersion::of_library()?;
    Ok(Finding { healthy: true, seen: format!("MuJoCo {version}, headers and library alike") })
}

fn reach(seed: u64) -> Result<(MujocoEnv, FetchObservation), EnvError> {
    let mut env = make("FetchReachDense-v4")?;
    let observation = env.reset(Some(seed))?.observation;
    Ok((env, observation))
}

fn dictionary(seed: u64) -> Result<Finding, EnvError> {
    let (env, observation) = reach(seed)?;
    let healthy = matches!(env.observation_space(), Space::Dict(_))
        && env.observation_space().contains(&observation.to_value());
    Ok(Finding {
        healthy,
        seen: "observation, achieved_goal and desired_goal, each of its own".into(),
    })
}

fn reach_shape(seed: u64) -> Result<Finding, EnvError> {
    let len = reach(seed)?.1.observation().len();
    Ok(Finding { healthy: len == 10, seen: format!("({len},)") })
}

fn wrapped_compute_reward(seed: u64) -> Result<Finding, EnvError> {
    let (env, observation) = reach(seed)?;
    let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
    // `env` is the time-limited environment, `inner` the one below.
    let outer = env.compute_reward(achieved, desired);
    let inner = env.inner().compute_reward(achieved, desired);
    Ok(Finding {
        healthy: outer.is_ok() && outer == inner,
        seen: format!("TimeLimit gives {outer:?}, the environment below {inner:?}"),
    })
}

fn reward_law(seed: u64) -> Result<Finding, EnvError> {
    let (mut env, mut observation) = reach(seed)?;
    let mut policy = RandomPolicy::new(seed);
    let mut differences = 0;
    for _ in 0..50 {
        let step = env.step(&policy.act(&observation))?;
        observation = step.observation;
        let computed = env.compute_reward(observation.achieved_goal(), observation.desired_goal());
        if computed.map(f64::to_bits) != Ok(step.reward.to_bits()) {
            differences += 1;
        }
    }
    Ok(Finding { healthy: differences == 0, seen: format!("{differences} of 50 steps differ") })
}

fn goals_differ(seed: u64) -> Result<Finding, EnvError> {
    let (mut env, first) = reach(seed)?;
    let again = env.reset(Some(seed))?.observation;
    let other = env.reset(Some(seed.wrapping_add(1)))?.observation;
    let next = env.reset(None)?.observation;
    let healthy = first == again && first != other && other != next;
    Ok(Finding {
        healthy,
        seen: "the same for the same seed, another for another and for none".into(),
    })
}

fn push_achieves_the_object(seed: u64) -> Result<Finding, EnvError> {
    let observation = make("FetchPush-v4")?.reset(Some(seed))?.observation;
    let achieved = observation.achieved_goal();
    let healthy =
        achieved == &observation.observation()[3..6] && achieved != &observation.observation()[..3];
    Ok(Finding { healthy, seen: "achieved_goal is obs[3..6], the object, as it should be".into() })
}

fn dense_is_registered(_seed: u64) -> Result<Finding, EnvError> {
    let known = EnvId::ALL.map(|id| id.to_string());
    let misspelled = make("FetchReachDense-v3").err().map_or(String::new(), |e| e.to_string());
    Ok(Finding {
        healthy: known.iter().any(|id| id == "FetchReachDense-v4")
            && misspelled.contains("nearest"),
        seen: format!("{} ids; for FetchReachDense-v3: {misspelled}", known.len()),
    })
}

fn random_success(seed: u64) -> Result<Finding, EnvError> {
    let (env, _) = reach(seed)?;
    let id = EnvId { task: env.inner().config().task(), reward: env.inner().config().reward() };
    let rate = evaluate_random(id, seed, 50)
        .and_then(|evaluation| Ok(evaluation.summary()?.success_rate.value))
        .unwrap_or(f64::NAN);
    let threshold = env.goal_reward().threshold().get();
    let seen = format!("{rate} in 50 episodes, threshold {threshold} m");
    Ok(Finding { healthy: rate <= 0.1 && threshold == 0.05, seen })
}

fn success_after_reset(seed: u64) -> Result<Finding, EnvError> {
    const RESETS: u64 = 200;
    let (mut env, _) = reach(seed)?;
    let mut successes = 0;
    for seed in (seed..).take(RESETS as usize) {
        if env.reset(Some(seed))?.info.is_success {
            successes += 1;
        }
    }
    let seen = format!("{successes} of {RESETS} resets");
    Ok(Finding { healthy: successes * 20 < RESETS, seen })
}

fn workspace(seed: u64) -> Result<Finding, EnvError> {
    let start = reach(seed)?.1.grip_position();
    let near = start.iter().zip([1.3419, 0.7491, 0.5347]).all(|(a, b)| (a - b).abs() < 1e-3);
    Ok(Finding { healthy: near, seen: format!("the gripper starts at {start:.4?} m") })
}

fn bad_actions(seed: u64) -> Result<Finding, EnvError> {
    let (mut env, _) = reach(seed)?;
    let refused = env.step(&[0.0, f32::NAN, 0.0, 0.0]);
    let healthy = matches!(refused, Err(EnvError::ActionNotFinite { .. }));
    // The libraries that take them go on with finite, wrong observations.
    let seen = refused.err().map_or_else(|| "a NaN was taken".into(), |error| error.to_string());
    Ok(Finding { healthy, seen })
}
