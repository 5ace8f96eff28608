//! Controllers written by hand, one for each task, that see only what a learning agent sees.

mod control;
mod pick_and_place;
mod push;
mod slide;

use fetch_env::{FetchObservation, Task};

use self::{
    control::{Command, OPEN, View},
    pick_and_place::Phase,
};
use crate::policy::Policy;

/// A policy that solves a task by a few rules, with gains found by trial.
///
/// | task | what it does |
/// |---|---|
/// | Reach | moves straight to the goal |
/// | Push | goes behind the object, as seen from the goal, and pushes, more slowly near the goal |
/// | PickAndPlace | comes from above, grasps, carries |
/// | Slide | goes behind the puck, and strikes it at the speed at which friction stops it at the goal |
#[derive(Clone, Debug)]
pub struct ScriptedPolicy {
    task: Task,
    /// The state of PickAndPlace; the other tasks need none.
    phase: Phase,
}

impl ScriptedPolicy {
    /// Returns the policy for a task.
    #[must_use]
    pub fn new(task: Task) -> Self {
        Self { task, phase: Phase::default() }
    }
}

impl Policy for ScriptedPolicy {
    fn reset(&mut self) {
        self.phase = Phase::default();
    }

    fn act(&mut self, observation: &FetchObservation, action: &mut [f32]) {
        let view = View::new(observation);
        let command = match (self.task, view.object) {
            (Task::Reach, _) => Command::toward(view.goal - view.gripper, OPEN),
            (Task::Push, Some(object)) => push::act(&view, &object),
            (Task::PickAndPlace, Some(object)) => self.phase.act(&view, &object),
            (Task::Slide, Some(object)) => slide::act(&view, &object),
            // This policy was made for another task: there is no object to move.
            (_, None) => Command::HOLD,
        };
        action.copy_from_slice(&command.action());
    }
}
