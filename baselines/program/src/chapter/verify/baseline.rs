//! Section 2.9: the random baseline, compared with the real environment's.

use baselines::{RandomPolicy, evaluate};
use fetch_env::{Env, EnvId, MujocoEnv};
use fetch_sim::Task;
use goal_reward::RewardKind;

use crate::shared::{check::Check, json::Metric, reference::RandomReference};

const EPISODES: usize = 100;

/// The p-value below which a difference from the reference is a fault. With a few dozen such tests,
/// one run in 400 fails by chance.
const LEAST_P_VALUE: f64 = 1e-4;

pub(crate) fn check(id: EnvId, env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Vec<Check>> {
    let mut policy = RandomPolicy::new(env.action_space(), seed);
    let evaluation = evaluate(env, &mut policy, EPISODES, seed, |_| ())?;
    let summary = evaluation.summary()?;
    let lengths = summary.episode_length_mean;
    let mut checks = vec![Check::new(
        "baseline/episode_length_mean",
        lengths.value == 50.0 && lengths.low == lengths.high,
        format!("{} steps in each of {EPISODES} episodes", lengths.value),
        Metric::new(lengths.value, "steps"),
    )];
    for comparison in RandomReference::new(id.task, id.reward).compare(&evaluation)? {
        let (measured, reference, p) =
            (comparison.measured, comparison.reference, comparison.p_value);
        let chapter = chapters_range(id, comparison.name).map_or(String::new(), |(low, high)| {
            let verdict = if (low..=high).contains(&reference) { "agrees" } else { "differs" };
            format!("; the chapter's {low} to {high} {verdict}")
        });
        checks.push(Check::new(
            format!("baseline/{}", comparison.name),
            p >= LEAST_P_VALUE,
            format!("{measured:.3} (reference {reference:.3}, p = {p:.2}{chapter})"),
            Metric::new(measured, if comparison.name == "final_distance_mean" { "m" } else { "1" }),
        ));
    }
    Ok(checks)
}

/// Returns the range that section 2.9 gives for ten episodes of dense Reach.
fn chapters_range(id: EnvId, figure: &str) -> Option<(f64, f64)> {
    match (id.task, id.reward, figure) {
        (Task::Reach, _, "success_rate") => Some((0.0, 0.1)),
        (Task::Reach, RewardKind::Dense, "episode_return_mean") => Some((-25.0, -10.0)),
        (Task::Reach, _, "final_distance_mean") => Some((0.05, 0.15)),
        _ => None,
    }
}
