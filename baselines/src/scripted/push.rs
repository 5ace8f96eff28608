use nalgebra::Vector3;

use super::{
    CLOSE, Command, GAIN,
    approach::{get_behind, off_line, to_push_height},
    view::{ObjectView, View},
};

/// Near enough: the gripper leaves the object alone (meters).
const CLOSE_ENOUGH: f64 = 0.02;

/// How far behind the object's center the push begins (meters).
const GAP: f64 = 0.068;

/// Action per meter that the object still has to go.
const SPEED_GAIN: f64 = 6.0;

/// Action per meter off the line of the push.
const LINE_GAIN: f64 = 25.0;

pub(super) fn act(view: &View, object: &ObjectView) -> Command {
    let to_goal = (view.goal - object.position).xy();
    let distance = to_goal.norm();
    if distance < CLOSE_ENOUGH {
        return Command::HOLD;
    }
    let direction = to_goal / distance;
    get_behind(view, object, direction, GAP).unwrap_or_else(|| {
        let speed = (SPEED_GAIN * distance).min(1.0);
        let along = direction * speed - LINE_GAIN * off_line(view, object, direction);
        let height = GAIN * to_push_height(view, object);
        Command { displacement: Vector3::new(along.x, along.y, height), fingers: CLOSE }
    })
}
