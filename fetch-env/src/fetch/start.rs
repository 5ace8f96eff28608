//! Starts that options set: where the gripper is, how the object lies, and an object in the hand.

use fetch_sim::{Control, SimError, Simulator};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::error::StartError;
use super::reset::FetchResetOptions;
use crate::gym::error::EnvError;

/// The farthest that the gripper ends from where it is sent, in meters.
const NEAR: f64 = 1e-3;
/// The speed below which it has arrived, in meters per second.
const SLOW: f64 = 1e-2;
/// The most steps on its way. Most ways over the table take 16, and those to the limits of its reach up
/// to 93.
const MOST_STEPS: usize = 100;
/// The farthest that it moves in one step, in meters: as in an action.
const STRIDE: f64 = 0.05;
/// The share of a miss that the next step corrects.
const CORRECTED: f64 = 0.3;
/// Where the object waits meanwhile, in meters: above all that moves.
const OUT_OF_THE_WAY: Vector3<f64> = Vector3::new(0.0, 0.0, 3.0);
/// Steps in which the fingers open wide, and steps in which they close on an object.
const OPENING: usize = 4;
const CLOSING: usize = 8;
/// Steps in which the fingers alone hold the object, and how far it may slip in them, in meters.
const HOLDING: usize = 4;
const SLIP: f64 = 0.02;

/// Arranges the start that options ask for in a simulator that has just been reset. Without such
/// options nothing changes.
pub(super) fn arrange<S: Simulator>(
    simulator: &mut S,
    options: &FetchResetOptions,
) -> Result<(), EnvError> {
    let held = options.object_in_gripper();
    let (height, rotation) = (options.object_height(), options.object_rotation());
    let mut place = simulator.object().map(|object| object.position);
    if let (Some(place), Some(height)) = (&mut place, height) {
        place.z = height;
    }
    let turned = rotation.map_or(UnitQuaternion::identity(), |[w, i, j, k]| {
        UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k))
    });
    if let Some(target) = options.gripper_position() {
        move_gripper(simulator, target.into())?;
    }
    if held {
        return grasp(simulator);
    }
    let is_moved = options.gripper_position().is_some() || height.is_some() || rotation.is_some();
    match place {
        Some(place) if is_moved => Ok(simulator.place_task_object(place, turned)?),
        _ => Ok(()),
    }
}

/// Simulates a step in which the object is held in a place, or out of the way.
fn step_around<S: Simulator>(
    simulator: &mut S,
    object: Vector3<f64>,
    displacement: Vector3<f64>,
    fingers: f64,
) -> Result<(), SimError> {
    if simulator.object().is_some() {
        simulator.place_task_object(object, UnitQuaternion::identity())?;
    }
    simulator.step(&Control { displacement, fingers })
}

/// Moves the gripper to a place.
fn move_gripper<S: Simulator>(simulator: &mut S, target: Vector3<f64>) -> Result<(), EnvError> {
    let from = simulator.gripper().position.into();
    // The arm yields to its weight: without what was missed so far, it would stop short.
    let mut missed = Vector3::zeros();
    for _ in 0..MOST_STEPS {
        let gripper = simulator.gripper();
        let way = target - gripper.position;
        if way.norm() < NEAR && gripper.velocity.norm() < SLOW {
            return Ok(());
        }
        if way.norm() < STRIDE {
            missed += way * CORRECTED;
        }
        let stride = (way + missed).map(|meters| meters.clamp(-STRIDE, STRIDE));
        step_around(simulator, OUT_OF_THE_WAY, stride, 0.0)?;
    }
    let reached = simulator.gripper().position.into();
    Err(StartError::OutOfReach { from, reached }.into())
}

/// Closes the fingers on the object.
fn grasp<S: Simulator>(simulator: &mut S) -> Result<(), EnvError> {
    let at = simulator.gripper().position;
    let stay = |simulator: &S| at - simulator.gripper().position;
    for _ in 0..OPENING {
        let stay = stay(simulator);
        step_around(simulator, OUT_OF_THE_WAY, stay, 1.0)?;
    }
    for _ in 0..CLOSING {
        let (stay, between) = (stay(simulator), simulator.gripper().position);
        step_around(simulator, between, stay, -1.0)?;
    }
    for _ in 0..HOLDING {
        let displacement = stay(simulator);
        simulator.step(&Control { displacement, fingers: -1.0 })?;
    }
    let slip = simulator.object().map(|object| object.position - simulator.gripper().position);
    if slip.is_none_or(|slip| slip.norm() > SLIP) {
        Err(StartError::Slipped.into())
    } else {
        Ok(())
    }
}
