//! PickAndPlace: grasps the object from above and carries it.

use nalgebra::Vector3;

use super::control::{CLOSE, Command, OPEN, ObjectView, View};

/// Distance from the object's center within which the gripper can grasp it (meters).
const GRASP_DISTANCE: f64 = 0.01;

/// Horizontal distance within which the gripper comes down onto the object (meters).
const DESCENT_DISTANCE: f64 = 0.02;

/// Height above the object's center at which the open fingers pass over it (meters).
const HOVER_HEIGHT: f64 = 0.08;

/// Number of control steps that the fingers need to close.
const CLOSING_STEPS: u32 = 4;

/// Distance from the gripper beyond which the object has slipped (meters).
const SLIP_DISTANCE: f64 = 0.03;

/// The phases in which the object is brought to the goal.
#[derive(Clone, Copy, Debug, Default)]
pub(super) enum Phase {
    #[default]
    Approach,
    Grasp {
        steps: u32,
    },
    Carry,
}

impl Phase {
    pub(super) fn act(&mut self, view: &View, object: &ObjectView) -> Command {
        let to_object = object.position - view.gripper;
        match *self {
            Self::Approach => self.approach(to_object),
            Self::Grasp { steps: CLOSING_STEPS } => {
                *self = Self::Carry;
                Command::toward(to_object, CLOSE)
            }
            Self::Grasp { steps } => {
                *self = Self::Grasp { steps: steps + 1 };
                Command::toward(to_object, CLOSE)
            }
            Self::Carry => {
                if to_object.norm() > SLIP_DISTANCE {
                    *self = Self::Approach;
                }
                Command::toward(view.goal - object.position, CLOSE)
            }
        }
    }

    fn approach(&mut self, to_object: Vector3<f64>) -> Command {
        let aside = to_object.xy().norm();
        if aside < GRASP_DISTANCE && to_object.z.abs() < GRASP_DISTANCE {
            *self = Self::Grasp { steps: 1 };
            return Command::toward(to_object, CLOSE);
        }
        let height = if aside > DESCENT_DISTANCE { HOVER_HEIGHT } else { 0.0 };
        Command::toward(to_object + Vector3::new(0.0, 0.0, height), OPEN)
    }
}
