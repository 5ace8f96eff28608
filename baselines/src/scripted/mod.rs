//! Controllers written by hand, one for each task, that see only what a learning agent sees.

mod control;
mod pick_and_place;
mod push;
mod slide;

use fetch_env::{FetchObservation, Task};

use self::{
    control::{Command, OPEN, View},
    pick_and_place::PickAndPlace,
};
use crate::policy::{Action, Policy};

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
    controller: Controller,
}

#[derive(Clone, Debug)]
enum Controller {
    Reach,
    Push,
    PickAndPlace(PickAndPlace),
    Slide,
}

impl ScriptedPolicy {
    /// Returns the policy for a task.
    #[must_use]
    pub fn new(task: Task) -> Self {
        let controller = match task {
            Task::Reach => Controller::Reach,
            Task::Push => Controller::Push,
            Task::PickAndPlace => Controller::PickAndPlace(PickAndPlace::default()),
            Task::Slide => Controller::Slide,
        };
        Self { controller }
    }
}

impl Policy for ScriptedPolicy {
    fn reset(&mut self) {
        if let Controller::PickAndPlace(controller) = &mut self.controller {
            *controller = PickAndPlace::default();
        }
    }

    fn act(&mut self, observation: &FetchObservation) -> Action {
        let view = View::new(observation);
        let command = match (&mut self.controller, view.object) {
            (Controller::Reach, _) => Command::toward(view.goal - view.gripper, OPEN),
            (Controller::Push, Some(object)) => push::act(&view, &object),
            (Controller::PickAndPlace(controller), Some(object)) => controller.act(&view, &object),
            (Controller::Slide, Some(object)) => slide::act(&view, &object),
            // This controller was made for another task: there is no object to move.
            (_, None) => Command::HOLD,
        };
        command.action()
    }
}
