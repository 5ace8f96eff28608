use nalgebra::{Vector2, Vector3};

use super::{
    CLOSE, Command,
    view::{ObjectView, View},
};

/// How far below the object's center the closed fingers push (meters).
const PUSH_DEPTH: f64 = 0.005;

/// How far above the object's center the closed fingers pass over it (meters).
const HOVER_HEIGHT: f64 = 0.09;

/// Lower than this above the object's center, the fingers would drag it along (meters).
const CLEAR_HEIGHT: f64 = 0.055;

/// Nearer than this to the object's center, the fingers may touch it (meters).
const CLEAR_DISTANCE: f64 = 0.07;

/// The height at which the gripper pushes the object, as a distance from where it is (meters).
pub(super) fn to_push_height(view: &View, object: &ObjectView) -> f64 {
    object.position.z - PUSH_DEPTH - view.gripper.z
}

/// How far the gripper is from the line through the object along `direction` (meters).
pub(super) fn off_line(view: &View, object: &ObjectView, direction: Vector2<f64>) -> Vector2<f64> {
    let from_object = (view.gripper - object.position).xy();
    from_object - direction * from_object.dot(&direction)
}

/// Brings the closed gripper `gap` meters behind the object, ready to push it along `direction`;
/// `None` once it is there.
///
/// It goes straight where that leaves the object alone, and over the object otherwise.
pub(super) fn get_behind(
    view: &View,
    object: &ObjectView,
    direction: Vector2<f64>,
    gap: f64,
) -> Option<Command> {
    let from_object = (view.gripper - object.position).xy();
    let above = view.gripper.z - object.position.z;
    if from_object.dot(&direction) < -0.03
        && off_line(view, object, direction).norm() < 0.03
        && above < 0.025
    {
        return None;
    }
    let way = object.position.xy() - direction * gap - view.gripper.xy();
    let at_height = |dz: f64| Some(Command::toward(Vector3::new(way.x, way.y, dz), CLOSE));
    let length = way.norm();
    if length < 0.02 {
        return at_height(to_push_height(view, object));
    }
    let heading = way / length;
    let nearest = from_object + heading * (-from_object.dot(&heading)).clamp(0.0, length);
    if nearest.norm() > CLEAR_DISTANCE - 0.005 && above < CLEAR_HEIGHT {
        return at_height(to_push_height(view, object));
    }
    if above < CLEAR_HEIGHT && from_object.norm() < CLEAR_DISTANCE + 0.005 {
        return Some(Command { displacement: Vector3::new(0.0, 0.0, 1.0), fingers: CLOSE });
    }
    at_height(HOVER_HEIGHT - above)
}
