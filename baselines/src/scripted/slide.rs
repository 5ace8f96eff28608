//! Slide: goes behind the puck and strikes it.

use nalgebra::{Vector2, Vector3};

use super::{
    control::{CLOSE, Command, ObjectView, View},
    push::push_along,
};

/// Distance to the goal within which the gripper leaves the puck alone (meters).
const CLOSE_ENOUGH: f64 = 0.02;

/// Distance behind the puck's center at which the strike begins (meters).
const GAP: f64 = 0.08;

/// Speed below which the puck counts as resting (meters per second).
const RESTING_SPEED: f64 = 0.08;

/// Distance within which gripper and puck touch (meters).
const CONTACT_DISTANCE: f64 = 0.06;

/// Share of the wanted speed at which the gripper backs off.
const RELEASE: f64 = 0.97;

/// Speed of the puck after a strike with an action of 1 (meters per second).
pub(super) const STRIKE_SPEED: f64 = 0.95;

/// The weakest strike, as an action.
const LEAST_STRIKE: f64 = 0.2;

/// Deceleration of the puck by friction: 0.1 times gravity (meters per second squared).
const DECELERATION: f64 = 0.981;

pub(super) fn act(view: &View, object: &ObjectView) -> Command {
    let to_goal = (view.goal - object.position).xy();
    if to_goal.norm() < CLOSE_ENOUGH {
        return Command::HOLD;
    }
    let wanted = launch_velocity(to_goal);
    let speed = wanted.norm();
    let direction = wanted / speed;
    if object.velocity.xy().norm() > RESTING_SPEED {
        if object.velocity.xy().dot(&direction) >= RELEASE * speed {
            let back = -direction;
            return Command { displacement: Vector3::new(back.x, back.y, 0.0), fingers: CLOSE };
        }
        if (view.gripper - object.position).xy().norm() > CONTACT_DISTANCE {
            return Command::HOLD;
        }
    }
    push_along(view, object, direction, GAP, (speed / STRIKE_SPEED).clamp(LEAST_STRIKE, 1.0))
}

/// Returns the velocity at which the puck comes to rest `to_goal` away.
///
/// MuJoCo's friction cone is a pyramid: all of the deceleration `a` acts along the axis of the
/// faster component until both are equal, and then half of it along each. With the longer way `l`
/// and the shorter `s` the speeds are `sqrt(a / 2) * (sqrt(l + s) +- sqrt(l - s))`.
pub(super) fn launch_velocity(to_goal: Vector2<f64>) -> Vector2<f64> {
    let way = to_goal.abs();
    let (longer, shorter) = (way.max(), way.min());
    let (sum, difference) = ((longer + shorter).sqrt(), (longer - shorter).sqrt());
    let scale = (0.5 * DECELERATION).sqrt();
    let (fast, slow) = (scale * (sum + difference), scale * (sum - difference));
    let (x, y) = if way.x >= way.y { (fast, slow) } else { (slow, fast) };
    Vector2::new(x.copysign(to_goal.x), y.copysign(to_goal.y))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::{DECELERATION, launch_velocity};

    /// Simulates the pyramid's friction in small steps of time.
    fn rest_after(mut velocity: Vector2<f64>) -> Vector2<f64> {
        let dt = 1e-5;
        let mut position = Vector2::zeros();
        while velocity.amax() > 1e-4 {
            position += velocity * dt;
            let axis = velocity.iamax();
            velocity[axis] -= (DECELERATION * dt).copysign(velocity[axis]);
        }
        position
    }

    #[test]
    fn the_puck_stops_where_it_was_sent() {
        for to_goal in [[0.4, 0.0], [0.3, 0.2], [-0.1, 0.25], [0.2, -0.2]] {
            let to_goal = Vector2::from(to_goal);
            let error = (rest_after(launch_velocity(to_goal)) - to_goal).norm();
            assert!(error < 1e-3, "{to_goal:?}: off by {error}");
        }
    }
}
