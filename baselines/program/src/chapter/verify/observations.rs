//! Section 2.3: observations, and the range of goals.

use anyhow::Context;
use fetch_env::{Env, EnvId, FetchObservation, GoalObservation, MujocoEnv, ObservationField};
use fetch_sim::{Simulator, Task};
use nalgebra::Vector3;

use crate::shared::{check::Check, json::Metric};

const RESETS: usize = 100;

pub(crate) fn check(id: EnvId, env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Vec<Check>> {
    let first = env.reset(Some(seed))?.observation;
    let resets: Vec<FetchObservation> = (seed..)
        .take(RESETS)
        .map(|seed| Ok(env.reset(Some(seed))?.observation))
        .collect::<anyhow::Result<_>>()?;
    Ok(vec![
        shapes(id, &first),
        finite(&resets),
        achieved_goal(id, &resets)?,
        goals_within_range(id, env, &resets),
        goals_differ(&resets),
    ])
}

fn shapes(id: EnvId, observation: &FetchObservation) -> Check {
    let expected = if id.task.has_object() { 25 } else { 10 };
    let (obs, ag, dg) = (
        observation.observation().len(),
        observation.achieved_goal().len(),
        observation.desired_goal().len(),
    );
    let seen = format!("obs=({obs},), ag=({ag},), dg=({dg},)");
    let passed = (obs, ag, dg) == (expected, 3, 3);
    Check::new("observation/shapes", passed, seen, Metric::count(obs))
}

fn finite(resets: &[FetchObservation]) -> Check {
    let values =
        |o: &FetchObservation| [o.observation(), o.achieved_goal(), o.desired_goal()].concat();
    let faults = resets.iter().flat_map(values).filter(|value| !value.is_finite()).count();
    Check::none_of(
        "observation/finite",
        faults,
        format!("{faults} values not finite, {RESETS} resets"),
    )
}

/// Checks that the achieved goal is the gripper's position in Reach, and the object's elsewhere.
fn achieved_goal(id: EnvId, resets: &[FetchObservation]) -> anyhow::Result<Check> {
    let (name, what) =
        if id.task.has_object() { ("object_pos", "object") } else { ("grip_pos", "gripper") };
    let field = ObservationField::find(id.task, name).context("an unknown field")?;
    let range = &field.range;
    let differs = |o: &&FetchObservation| o.achieved_goal() != &o.observation()[range.clone()];
    let faults = resets.iter().filter(differs).count();
    let seen =
        format!("phi(s) = obs[{}:{}], the {what}; {faults} mismatches", range.start, range.end);
    Ok(Check::none_of("goal-space/phi", faults, seen))
}

/// Checks that every goal is within the task's range and offset and, in Reach, the chapter's box.
fn goals_within_range(id: EnvId, env: &MujocoEnv, resets: &[FetchObservation]) -> Check {
    let config = id.config();
    let settled = env.inner().simulator().settled();
    let center = settled.gripper_position + Vector3::from(config.target_offset());
    let reach = config.target_range();
    let faults = resets
        .iter()
        .filter(|o| {
            let goal = Vector3::from_column_slice(o.desired_goal());
            let aside = (goal - center).xy().amax() > reach;
            let height = match settled.object_height {
                None => (goal.z - center.z).abs() > reach,
                Some(table) if config.target_in_the_air() => {
                    !(table..table + 0.45).contains(&goal.z)
                }
                Some(table) => goal.z != table,
            };
            aside || height
        })
        .count();
    let goals = || resets.iter().map(|o| o.desired_goal());
    let along = |axis: usize| goals().map(move |goal| goal[axis]);
    let low = [0, 1, 2].map(|axis| along(axis).fold(f64::INFINITY, f64::min));
    let high = [0, 1, 2].map(|axis| along(axis).fold(f64::NEG_INFINITY, f64::max));
    let seen = format!("{low:.2?} to {high:.2?} m, {faults} outside the task's range");
    let in_chapters_box = |o: &&FetchObservation| {
        let goal = o.desired_goal();
        (1.1..=1.5).contains(&goal[0])
            && (0.5..=1.0).contains(&goal[1])
            && (0.35..=0.75).contains(&goal[2])
    };
    let outside_box = match id.task {
        Task::Reach => resets.len() - resets.iter().filter(in_chapters_box).count(),
        _ => 0,
    };
    Check::none_of("goal-space/bounds", faults + outside_box, seen)
}

fn goals_differ(resets: &[FetchObservation]) -> Check {
    let mut goals: Vec<_> = resets.iter().map(|o| o.desired_goal().to_vec()).collect();
    goals.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    goals.dedup();
    let seen = format!("{} different goals in {RESETS} resets", goals.len());
    Check::new("goal-space/goals-differ", goals.len() == RESETS, seen, Metric::count(goals.len()))
}
