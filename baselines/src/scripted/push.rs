//! Push: goes behind the object and pushes it. Slide approaches the puck in the same way.

use nalgebra::{Vector2, Vector3};

use super::control::{CLOSE, Command, GAIN, ObjectView, View};

/// Distance to the goal within which the gripper leaves the object alone (meters).
const CLOSE_ENOUGH: f64 = 0.02;

/// Distance behind the object's center at which the push begins (meters).
const GAP: f64 = 0.068;

/// Action per meter between the object and its goal.
const SPEED_GAIN: f64 = 6.0;

/// Action per meter off the line of the push.
pub(super) const LINE_GAIN: f64 = 25.0;

/// Depth below the object's center at which the closed fingers push (meters).
const PUSH_DEPTH: f64 = 0.005;

/// Height above the object's center at which the closed fingers pass over it (meters).
const HOVER_HEIGHT: f64 = 0.09;

/// Height above the object's center below which the fingers would drag it along (meters).
const CLEAR_HEIGHT: f64 = 0.055;

/// Distance from the object's center within which the fingers may touch it (meters).
const CLEAR_DISTANCE: f64 = 0.07;

pub(super) fn act(view: &View, object: &ObjectView) -> Command {
    let to_goal = (view.goal - object.position).xy();
    let distance = to_goal.norm();
    if distance < CLOSE_ENOUGH {
        return Command::HOLD;
    }
    push_along(view, object, to_goal / distance, GAP, (SPEED_GAIN * distance).min(1.0))
}

/// Brings the closed gripper `gap` meters behind the object, and then pushes along `direction`,
/// with an action of `speed`.
pub(super) fn push_along(
    view: &View,
    object: &ObjectView,
    direction: Vector2<f64>,
    gap: f64,
    speed: f64,
) -> Command {
    get_behind(view, object, direction, gap).unwrap_or_else(|| {
        let along = direction * speed - LINE_GAIN * off_line(view, object, direction);
        let height = GAIN * to_push_height(view, object);
        Command { displacement: Vector3::new(along.x, along.y, height), fingers: CLOSE }
    })
}

/// Returns the way up to the height at which the gripper pushes the object (meters).
pub(super) fn to_push_height(view: &View, object: &ObjectView) -> f64 {
    object.position.z - PUSH_DEPTH - view.gripper.z
}

/// Returns the gripper's offset from the line through the object along `direction` (meters).
fn off_line(view: &View, object: &ObjectView, direction: Vector2<f64>) -> Vector2<f64> {
    let from_object = (view.gripper - object.position).xy();
    from_object - direction * from_object.dot(&direction)
}

/// Brings the closed gripper `gap` meters behind the object, ready to push it along `direction`;
/// `None` once it is there.
///
/// It goes straight if that does not touch the object, and over the object otherwise.
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
