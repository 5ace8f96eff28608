//! One start, and the results from it.

use std::{fmt, time::Duration};

use baselines::Plan;
use fetch_env::{FetchObservation, GoalObservation, goal_reward::goal_distance};

use crate::shared::json::Metric;

/// The players of an episode, in the order of [`Start::plans`].
pub const PLAYERS: [&str; 3] = ["planned", "scripted", "trained"];

/// The distance within which an object counts as untouched (meters).
const STILL: f64 = 0.05;

/// The least height that an object falls when it falls off the table (meters).
const FALL: f64 = 0.1;

/// A start, and how the episode from it ends.
pub struct Start {
    pub seed: u64,
    /// Distance between achieved and desired goal (meters).
    pub distance: f64,
    achieved_goal: Vec<f64>,
    desired_goal: Vec<f64>,
    /// The time that planning took.
    pub seconds: f64,
    /// The plan of each of the [`PLAYERS`].
    pub plans: [Plan; 3],
}

/// Why a plan does not achieve its goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The object or gripper was not moved: the arm cannot reach where it would have to be.
    Untouched,
    /// It stops short of the goal.
    Short,
    /// It goes past the goal, or off the table.
    Past,
}

impl Failure {
    pub const ALL: [Self; 3] = [Self::Short, Self::Past, Self::Untouched];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Untouched => "untouched",
            Self::Short => "short",
            Self::Past => "past",
        }
    }
}

impl Start {
    pub fn new(
        seed: u64,
        observation: &FetchObservation,
        seconds: Duration,
        plans: [Plan; 3],
    ) -> Self {
        let achieved_goal = observation.achieved_goal().to_vec();
        let desired_goal = observation.desired_goal().to_vec();
        let distance = goal_distance(&achieved_goal, &desired_goal);
        let seconds = seconds.as_secs_f64();
        Self { seed, distance, achieved_goal, desired_goal, seconds, plans }
    }

    /// Returns the plan of the planner.
    pub const fn planned(&self) -> &Plan {
        &self.plans[0]
    }

    /// Returns why the planner's plan fails; `None` if it succeeds.
    pub fn failure(&self) -> Option<Failure> {
        let plan = self.planned();
        if plan.episode.success {
            return None;
        }
        let way = |from: &[f64], to: &[f64]| -> Vec<f64> {
            to.iter().zip(from).map(|(to, from)| to - from).collect()
        };
        let moved = way(&self.achieved_goal, &plan.achieved_goal);
        let wanted = way(&self.achieved_goal, &self.desired_goal);
        let left = way(&plan.achieved_goal, &self.desired_goal);
        let along: f64 = left.iter().zip(&wanted).map(|(left, wanted)| left * wanted).sum();
        Some(if goal_distance(&self.achieved_goal, &plan.achieved_goal) < STILL {
            Failure::Untouched
        } else if moved[2] < wanted[2].min(0.0) - FALL || along < 0.0 {
            Failure::Past
        } else {
            Failure::Short
        })
    }

    /// Returns the figures of this start.
    pub fn figures(&self, title: &str) -> Vec<(String, Metric)> {
        let name = |figure: &str| format!("{title}/seed-{}/{figure}", self.seed);
        let plan = self.planned();
        let mut figures = vec![
            (name("goal_distance"), Metric::new(self.distance, "m")),
            (name("rollouts"), Metric::count(plan.rollouts)),
            (name("seconds"), Metric::new(self.seconds, "s")),
        ];
        for (player, plan) in PLAYERS.iter().zip(&self.plans) {
            let name = |figure| name(&format!("{player}/{figure}"));
            figures.push((name("final_distance"), Metric::new(plan.episode.final_distance, "m")));
            if let Some(steps) = plan.steps_to_goal {
                figures.push((name("steps_to_goal"), Metric::count(steps)));
            }
        }
        figures
    }
}

impl fmt::Display for Start {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seed, distance, seconds, .. } = self;
        let plan = self.planned();
        write!(f, "seed {seed}, goal {distance:.2} m away: ")?;
        match self.failure() {
            None => write!(f, "achieved at step {}", plan.steps_to_goal.unwrap_or_default())?,
            Some(failure) => {
                write!(f, "{}, {:.3} m left", failure.name(), plan.episode.final_distance)?;
            }
        }
        write!(f, "; rollouts: {}, {seconds:.1} s", plan.rollouts)
    }
}
