//! A single strike of the puck, with a few parameters.

use fetch_env::{GoalObservation, Task};
use her_relabel::Scalar;
use nalgebra::{Rotation2, Vector2, Vector3};

use super::{
    control::{CLOSE, Columns, Command, GAIN, ObjectView, View},
    push::{LINE_GAIN, get_behind, to_push_height},
    slide::{STRIKE_SPEED, launch_velocity},
};
use crate::policy::Policy;

/// Distance within which the gripper counts as at the place where the strike begins (meters).
const ARRIVED: f64 = 0.02;

/// A controller that strikes the puck once, along a line that the first observation and the
/// parameters determine.
///
/// The gripper goes behind the puck, as far as the run-up says, and then along the line until it
/// has passed the puck's first place by the follow-through.
#[derive(Clone, Debug)]
pub(crate) struct Strike {
    columns: Columns,
    parameters: Parameters,
    line: Option<Line>,
}

#[derive(Clone, Copy, Debug)]
struct Parameters {
    /// Angle from the direction in which the puck, slowed by friction, slides to the goal
    /// (radians).
    angle: f64,
    /// What is added to the action that gives the puck the speed at which it stops at the goal.
    speed: f64,
    /// Distance behind the puck's center at which the strike begins (meters).
    run_up: f64,
    /// Distance beyond the puck's first place at which it ends (meters).
    follow_through: f64,
}

/// The line of a strike.
#[derive(Clone, Copy, Debug)]
struct Line {
    /// The puck before the strike.
    puck: ObjectView,
    direction: Vector2<f64>,
    /// The length of the action along it.
    speed: f64,
    phase: Phase,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Approach,
    Strike,
    Retreat,
}

impl Strike {
    /// The mean of angle (radians), speed (action), run-up and follow-through (meters) from which
    /// to search, and their standard deviations.
    pub(crate) const MEAN: [f64; 4] = [0.0, 0.0, 0.12, 0.05];
    pub(crate) const SPREAD: [f64; 4] = [0.15, 0.2, 0.04, 0.05];

    /// Returns a strike with parameters in the order of [`MEAN`](Self::MEAN).
    pub(crate) fn new(parameters: &[f64]) -> Self {
        let number = |index: usize| parameters.get(index).copied().unwrap_or(Self::MEAN[index]);
        let parameters = Parameters {
            angle: number(0),
            speed: number(1),
            run_up: number(2).clamp(0.06, 0.4),
            follow_through: number(3).clamp(-0.05, 0.5),
        };
        Self { columns: Columns::of(Task::Slide), parameters, line: None }
    }

    /// Returns the line through the puck.
    fn line(&self, view: &View, puck: ObjectView) -> Line {
        let launch = launch_velocity((view.goal - puck.position).xy());
        let speed = launch.norm();
        let direction = Rotation2::new(self.parameters.angle) * (launch / speed.max(1e-9));
        // No element of an action exceeds 1.
        let most = 1.0 / direction.amax().max(1e-9);
        let speed = (speed / STRIKE_SPEED + self.parameters.speed).clamp(0.1, most);
        Line { puck, direction, speed, phase: Phase::Approach }
    }

    fn command(&self, line: &mut Line, view: &View, object: &ObjectView) -> Command {
        let Line { puck, direction, .. } = *line;
        let from_puck = (view.gripper - puck.position).xy();
        let along = from_puck.dot(&direction);
        let height = to_push_height(view, &puck);
        let to_start = -direction * self.parameters.run_up - from_puck;
        let back = Command::toward(Vector3::new(to_start.x, to_start.y, height), CLOSE);
        if line.phase == Phase::Approach {
            let way = get_behind(view, object, direction, self.parameters.run_up);
            if way.is_some() || to_start.norm() > ARRIVED {
                return way.unwrap_or(back);
            }
            line.phase = Phase::Strike;
        }
        if along > self.parameters.follow_through {
            line.phase = Phase::Retreat;
        }
        if line.phase == Phase::Retreat {
            return back;
        }
        let aside = from_puck - direction * along;
        let push = direction * line.speed - LINE_GAIN * aside;
        Command { displacement: Vector3::new(push.x, push.y, GAIN * height), fingers: CLOSE }
    }
}

impl<O: GoalObservation<Element: Scalar>> Policy<O> for Strike {
    fn reset(&mut self) {
        self.line = None;
    }

    fn act(&mut self, observation: &O, action: &mut [f32]) {
        let view = View::new(&self.columns, observation);
        let seen = view.and_then(|view| Some((view, view.object?)));
        let command = seen.map(|(view, object)| {
            let mut line = self.line.unwrap_or_else(|| self.line(&view, object));
            let command = self.command(&mut line, &view, &object);
            self.line = Some(line);
            command
        });
        Command::write(command, action);
    }
}
