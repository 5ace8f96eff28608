//! Section 2.4: the effect of each action.

use fetch_env::{Env, EnvId, FetchObservation, MujocoEnv};

use crate::shared::{check::Check, json::Metric};

pub(crate) fn check(id: EnvId, env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Vec<Check>> {
    let mut checks = vec![space(env)];
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        checks.push(displacement(env, seed, axis, name)?);
    }
    checks.push(if id.task.block_gripper() {
        blocked_gripper(env, seed)?
    } else {
        moving_gripper(env, seed)?
    });
    Ok(checks)
}

fn space(env: &MujocoEnv) -> Check {
    let space = env.action_space();
    let passed = space.shape() == [4] && space.low() == [-1.0; 4] && space.high() == [1.0; 4];
    let seen =
        format!("action_shape={:?}, bounds {:?} to {:?}", space.shape(), space.low(), space.high());
    Check::new("action/space", passed, seen, Metric::count(space.low().len()))
}

/// Returns the observations before and after one step from a reset.
fn after(
    env: &mut MujocoEnv,
    seed: u64,
    action: [f32; 4],
) -> anyhow::Result<[FetchObservation; 2]> {
    let before = env.reset(Some(seed))?.observation;
    Ok([before, env.step(&action)?.observation])
}

/// The chapter says 0.005 to 0.02 m a step; the real environment moves 0.02 to 0.03 m from rest.
fn displacement(env: &mut MujocoEnv, seed: u64, axis: usize, name: &str) -> anyhow::Result<Check> {
    let mut action = [0.0; 4];
    action[axis] = 1.0;
    let [before, after] = after(env, seed, action)?.map(|o| o.grip_position());
    let moved = after[axis] - before[axis];
    let aside = (0..3)
        .filter(|&other| other != axis)
        .map(|other| (after[other] - before[other]).abs())
        .fold(0.0, f64::max);
    let passed = (0.005..0.05).contains(&moved) && aside < 0.5 * moved;
    let seen = format!("+1 moves the gripper {moved:+.4} m along {name}, {aside:.4} m sideways");
    Ok(Check::new(format!("action/d{name}"), passed, seen, Metric::new(moved, "m")))
}

/// Steps until the fingers, which are heavy, have reversed.
const CLOSING_STEPS: usize = 5;

/// A positive action opens the fingers; the chapter's table has the opposite sign.
fn moving_gripper(env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Check> {
    let [_, opened] = after(env, seed, [0.0, 0.0, 0.0, 1.0])?.map(|o| o.finger_positions());
    let mut closed = opened;
    for _ in 0..CLOSING_STEPS {
        closed = env.step(&[0.0, 0.0, 0.0, -1.0])?.observation.finger_positions();
    }
    let passed =
        opened[0] > 0.03 && opened[1] > 0.03 && closed[0] < opened[0] && closed[1] < opened[1];
    let seen = format!(
        "+1 opens the fingers to {:.4} m, -1 closes them to {:.4} m (the chapter's sign is \
         reversed)",
        opened[0], closed[0]
    );
    Ok(Check::new("action/gripper", passed, seen, Metric::new(opened[0], "m")))
}

fn blocked_gripper(env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Check> {
    let [_, with] = after(env, seed, [0.0, 0.0, 0.0, 1.0])?;
    let [_, without] = after(env, seed, [0.0; 4])?;
    let widest = with.finger_positions().into_iter().fold(0.0, f64::max);
    let seen = format!("no effect: the fingers are held at {widest:.4} m");
    Ok(Check::new(
        "action/gripper",
        with == without && widest == 0.0,
        seen,
        Metric::new(widest, "m"),
    ))
}
