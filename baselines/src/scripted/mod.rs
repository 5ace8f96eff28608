//! Controllers written by hand, one a task, that see only what a learning agent sees.

mod approach;
mod pick_and_place;
mod push;
mod reach;
mod slide;
mod view;

use fetch_env::{FetchObservation, Task};
use nalgebra::Vector3;

use self::{pick_and_place::PickAndPlace, view::View};
use crate::{Action, Policy};

/// Solves a task by a few rules; the gains were found by trial.
///
/// | task | what it does |
/// |---|---|
/// | Reach | moves straight to the goal |
/// | Push | goes behind the object, seen from the goal, and pushes, slower near the goal |
/// | PickAndPlace | comes from above, grasps, carries |
/// | Slide | goes behind the puck, and strikes with the speed at which friction stops it at the goal |
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
    /// The controller of a task.
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
            (Controller::Reach, _) => reach::act(&view),
            (Controller::Push, Some(object)) => push::act(&view, &object),
            (Controller::PickAndPlace(controller), Some(object)) => controller.act(&view, &object),
            (Controller::Slide, Some(object)) => slide::act(&view, &object),
            // Made for another task: there is no object to move.
            (_, None) => Command::HOLD,
        };
        command.action()
    }
}

/// An action before it is clipped.
#[derive(Clone, Copy, Debug)]
struct Command {
    displacement: Vector3<f64>,
    fingers: f64,
}

const OPEN: f64 = 1.0;
const CLOSE: f64 = -1.0;

/// Action per meter of distance: one action moves the gripper by about 0.03 m.
const GAIN: f64 = 20.0;

impl Command {
    const HOLD: Self = Self { displacement: Vector3::new(0.0, 0.0, 0.0), fingers: CLOSE };

    /// Toward a point that is `distance` away (meters).
    fn toward(distance: Vector3<f64>, fingers: f64) -> Self {
        Self { displacement: GAIN * distance, fingers }
    }

    fn action(self) -> Action {
        let [x, y, z] = self.displacement.into();
        [x, y, z, self.fingers].map(|value| value.clamp(-1.0, 1.0) as f32)
    }
}
