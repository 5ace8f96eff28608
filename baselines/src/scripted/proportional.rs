//! A proportional controller of the gripper.

use fetch_env::{GoalObservation, Space, Task};
use her_relabel::Scalar;

use super::control::{Columns, Command, View};
use crate::policy::{Policy, PolicyError};

/// A policy that moves the gripper straight to the goal: its action is a gain times the way from the
/// observed gripper to the goal, clipped, and leaves the fingers alone.
///
/// It solves Reach. What a policy has over it in the other tasks is what it has learned to plan.
#[derive(Clone, Debug)]
pub struct ProportionalPolicy {
    task: Task,
    columns: Columns,
    gain: f64,
}

impl ProportionalPolicy {
    /// The gain of [`new`](Self::new), as action per meter.
    pub const GAIN: f64 = 10.0;

    /// Returns the policy for a task.
    #[must_use]
    pub fn new(task: Task) -> Self {
        Self { task, columns: Columns::of(task), gain: Self::GAIN }
    }

    /// Sets the gain, in action per meter. One that is no number makes a policy that cannot act.
    #[must_use]
    pub const fn with_gain(self, gain: f64) -> Self {
        Self { gain, ..self }
    }
}

impl<O: GoalObservation<Element: Scalar>> Policy<O> for ProportionalPolicy {
    fn check_spaces(
        &self,
        observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        self.columns.check_spaces(self.task, observation_space, action_space)
    }

    fn act(&mut self, observation: &O, action: &mut [f32]) {
        let command = View::new(&self.columns, observation).map(|view| Command {
            displacement: self.gain * (view.goal - view.gripper),
            fingers: 0.0,
        });
        Command::write(command, action);
    }
}
