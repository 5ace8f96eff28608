//! `doctor`: looks for the problems of section 2.10, and says how to fix them.

use std::path::PathBuf;

use fetch_env::{
    BatchObservation, Env, EnvError, EnvId, FetchObservation, GoalEnvExt, GoalObservation,
    MujocoEnv, Space, make,
};
use fetch_sim::{MujocoVersion, Task};
use goal_reward::RewardKind;
use serde_json::json;

use super::{random_episodes::evaluate_random, verify::check_by_name};
use crate::shared::{
    check::mark,
    env_id::DENSE_REACH,
    json::{Metric, write_results},
    mujoco,
};

#[derive(clap::Args)]
pub struct Args {
    /// Seed of resets and actions
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Also write the findings as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Whether all is well, and what was seen, in words.
type Finding = (bool, String);

/// A problem, how to look for it, and how to fix it.
struct Symptom {
    name: &'static str,
    look: fn(u64) -> anyhow::Result<Finding>,
    fix: &'static str,
}

const PUSH: EnvId = EnvId { task: Task::Push, reward: RewardKind::Sparse };

const SYMPTOMS: [Symptom; 12] = [
    Symptom {
        name: "MuJoCo is missing, or not the one used for the build",
        look: library,
        fix: "apt-get update && apt-get install -y libmujoco-dev, or `fetch-env mujoco 3.6.0`, \
              and build again; a program from pip brings MuJoCo: install it again",
    },
    Symptom {
        name: "obs is a flat array, not a dictionary",
        look: dictionary,
        fix: "flatten in the policy, not in the environment: hindsight needs the three parts",
    },
    Symptom {
        name: "obs[\"observation\"] shape is not (10,) for FetchReach",
        look: |seed| verified(DENSE_REACH, seed, "observation/shapes"),
        fix: "check the environment id: tasks with an object observe 25 numbers",
    },
    Symptom {
        name: "compute_reward is not available through a wrapper",
        look: wrapped_compute_reward,
        fix: "implement KeepsGoals for the Wrapper if it keeps goals and rewards, else GoalWrapper",
    },
    Symptom {
        name: "step reward and compute_reward disagree",
        look: |seed| verified(DENSE_REACH, seed, "reward/law"),
        fix: "a wrapper that changes rewards must change its goal_reward() too",
    },
    Symptom {
        name: "desired_goal is identical across resets",
        look: goals_differ,
        fix: "pass a different seed to each reset, or none after the first",
    },
    Symptom {
        name: "achieved_goal does not match obs[\"observation\"][:3] for FetchPush",
        look: |seed| verified(PUSH, seed, "goal-space/phi"),
        fix: "nothing: where there is an object, achieved_goal is its position, object_pos",
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
        fix: "nothing if it is rare, because a goal may lie at the start; otherwise check the \
              seeds",
    },
    Symptom {
        name: "workspace bounds look wrong",
        look: workspace,
        fix: "check the model: the gripper starts at [1.34, 0.75, 0.53] in Reach",
    },
    Symptom {
        name: "actions that are not numbers are accepted",
        look: bad_actions,
        fix: "check the policy's output: the policy has diverged",
    },
];

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let mut healthy = true;
    let mut results = Vec::new();
    for symptom in &SYMPTOMS {
        let (well, seen) =
            (symptom.look)(args.seed).unwrap_or_else(|error| (false, format!("{error:#}")));
        say!("{}  {}\n      {seen}", mark(well), symptom.name)?;
        if !well {
            say!("      fix: {}", symptom.fix)?;
        }
        healthy &= well;
        let faults = Metric::count(usize::from(!well));
        results.push((format!("doctor/{}", symptom.name.replace(' ', "-")), faults));
    }
    write_results(args.json.as_ref(), json!({"seed": args.seed}), results)?;
    Ok(healthy)
}

fn finding(healthy: bool, seen: impl Into<String>) -> anyhow::Result<Finding> {
    Ok((healthy, seen.into()))
}

/// Returns the finding of one of verify's checks.
fn verified(id: EnvId, seed: u64, name: &str) -> anyhow::Result<Finding> {
    let check = check_by_name(id, seed, name)?;
    finding(check.passed, check.seen)
}

fn library(_seed: u64) -> anyhow::Result<Finding> {
    let mut seen = mujoco::in_use()?;
    if let Some(advice) = mujoco::advice()? {
        seen += &format!("\n      {advice}");
    }
    if MujocoVersion::of_library()?.to_string() == "4.0.0" {
        seen += "\n      its sparse Cholesky factorization is wrong (fixed in 4.0.1): no Fetch \
                 scene needs it, but models with 60 or more degrees of freedom, or with \
                 jacobian=\"sparse\", do";
    }
    finding(true, seen)
}

fn reach(seed: u64) -> anyhow::Result<(MujocoEnv, FetchObservation)> {
    let mut env = make("FetchReachDense-v4")?;
    let observation = env.reset(Some(seed))?.observation;
    Ok((env, observation))
}

fn dictionary(seed: u64) -> anyhow::Result<Finding> {
    let (env, observation) = reach(seed)?;
    let healthy = matches!(env.observation_space(), Space::Dict(_))
        && env.observation_space().contains(&observation.to_value(env.observation_space())?);
    finding(healthy, "observation, achieved_goal and desired_goal are separate")
}

fn wrapped_compute_reward(seed: u64) -> anyhow::Result<Finding> {
    let (env, observation) = reach(seed)?;
    let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
    // `env` is the time-limited environment, `inner` the one below.
    let outer = env.compute_reward(achieved, desired);
    let inner = env.inner().compute_reward(achieved, desired);
    let seen = format!("TimeLimit gives {outer:?}, the environment below {inner:?}");
    finding(outer.is_ok() && outer == inner, seen)
}

fn goals_differ(seed: u64) -> anyhow::Result<Finding> {
    let (mut env, first) = reach(seed)?;
    let again = env.reset(Some(seed))?.observation;
    let other = env.reset(Some(seed.wrapping_add(1)))?.observation;
    let next = env.reset(None)?.observation;
    let healthy = first == again && first != other && other != next;
    finding(healthy, "the same for the same seed, different for another seed and without one")
}

fn dense_is_registered(_seed: u64) -> anyhow::Result<Finding> {
    let known = EnvId::ALL.map(|id| id.to_string());
    let misspelled = make("FetchReachDense-v3").err().map_or(String::new(), |e| e.to_string());
    let healthy =
        known.iter().any(|id| id == "FetchReachDense-v4") && misspelled.contains("nearest");
    finding(healthy, format!("{} ids; for FetchReachDense-v3: {misspelled}", known.len()))
}

fn random_success(seed: u64) -> anyhow::Result<Finding> {
    let rate = evaluate_random(DENSE_REACH, seed, 50)?.summary()?.success_rate.value;
    let threshold = DENSE_REACH.config().distance_threshold().get();
    let seen = format!("{rate} in 50 episodes, threshold {threshold} m");
    finding(rate <= 0.1 && threshold == 0.05, seen)
}

fn success_after_reset(seed: u64) -> anyhow::Result<Finding> {
    const RESETS: usize = 200;
    let (mut env, _) = reach(seed)?;
    let mut successes = 0;
    for seed in (seed..).take(RESETS) {
        successes += usize::from(env.reset(Some(seed))?.info.is_success);
    }
    finding(successes * 20 < RESETS, format!("{successes} of {RESETS} resets"))
}

fn workspace(seed: u64) -> anyhow::Result<Finding> {
    let start = reach(seed)?.1.grip_position();
    let near = start.iter().zip([1.3419, 0.7491, 0.5347]).all(|(a, b)| (a - b).abs() < 1e-3);
    finding(near, format!("the gripper starts at {start:.4?} m"))
}

fn bad_actions(seed: u64) -> anyhow::Result<Finding> {
    let (mut env, _) = reach(seed)?;
    let rejected = env.step(&[0.0, f32::NAN, 0.0, 0.0]);
    let healthy = matches!(rejected, Err(EnvError::ActionNotFinite { .. }));
    // Libraries that accept them continue with finite, wrong observations.
    let seen =
        rejected.err().map_or_else(|| "a NaN was accepted".into(), |error| error.to_string());
    finding(healthy, seen)
}
