//! Dense against sparse reward: as functions, and along trajectories (exercise 2).

use crate::chapter::exercise::Trajectory;
use baselines::{
    RandomPolicy, ScriptedPolicy,
    page::{Axis, Ink, Plot},
};
use fetch_env::{Env, Task, make};
use goal_reward::{DistanceReward, DistanceThreshold, GoalReward, RewardKind};

/// Returns three plots: over distance, along a random and along a successful trajectory.
pub fn section(seed: u64) -> anyhow::Result<String> {
    let mut policy = RandomPolicy::new(make("FetchReach-v4")?.action_space(), seed);
    let random = Trajectory::of(&mut policy, seed)?;
    let scripted = Trajectory::of(&mut ScriptedPolicy::new(Task::Reach), seed)?;
    let plots = [
        over_distance(),
        along(&format!("Along a trajectory: random, seed {seed}"), &random),
        along(&format!("Along a trajectory: scripted, seed {seed}"), &scripted),
    ];
    let mut html = String::from(
        "<p>The dense reward is the negative distance in meters; the sparse one is 0 up to the \
         threshold of 0.05 m and −1 beyond it. The same actions in FetchReach-v4 and \
         FetchReachDense-v4 give the same trajectory and two rewards.</p>\n<div class=\"grid\">\n",
    );
    for plot in plots {
        html += &format!("<div>{}</div>\n", plot.svg()?);
    }
    Ok(html + "</div>")
}

fn plot(title: &str, x: Axis, low: f64) -> Plot {
    let mut plot = Plot::new(title, x, Axis::new("reward", low, 0.1));
    plot.legend(Ink::Blue, "dense");
    plot.legend(Ink::Orange, "sparse");
    plot
}

/// Plots the rewards at every millimeter of distance.
fn over_distance() -> Plot {
    let mut plot =
        plot("Reward over distance", Axis::new("distance to the goal (m)", 0.0, 0.3), -1.1);
    for (ink, kind) in [(Ink::Blue, RewardKind::Dense), (Ink::Orange, RewardKind::Sparse)] {
        let reward = DistanceReward::new(kind, DistanceThreshold::FETCH);
        let at = |distance: f64| reward.reward(&[distance, 0.0, 0.0], &[0.0; 3]);
        plot.line(ink, (0..=300).map(|mm| 1e-3 * f64::from(mm)).map(|d| (d, at(d))));
    }
    plot
}

fn along(title: &str, trajectory: &Trajectory) -> Plot {
    let steps = &trajectory.steps;
    let low = steps.iter().map(|step| step.dense).fold(-1.1, f64::min);
    let mut plot = plot(title, Axis::new("step", 0.0, steps.len() as f64), low);
    let numbered = || (1..).map(f64::from).zip(steps);
    plot.line(Ink::Blue, numbered().map(|(t, step)| (t, step.dense)));
    plot.line(Ink::Orange, numbered().map(|(t, step)| (t, step.sparse)));
    plot
}
