//! The kinematic simulator.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::{
    bounds::{check_inside, check_object_position, first_outside},
    config::SimConfig,
    error::SimError,
    physics::{Physics, PhysicsFactor},
    simulator::{Control, GripperState, ObjectState, Settled, Simulator},
    task::{Task, spec::ObjectSpec},
};

/// Duration of a substep, in seconds; MuJoCo's time step in the Fetch scenes.
const TIME_STEP: f64 = 0.002;
/// Range of the grip site along each axis, in meters: above the table and within the arm's reach.
const REACHABLE: [[f64; 2]; 3] = [[0.75, 1.6], [0.35, 1.15], [0.41, 1.1]];
/// Half of the object's width, in meters.
const OBJECT_RADIUS: f64 = 0.025;
/// Half of the closed gripper's width, in meters.
const GRIPPER_RADIUS: f64 = 0.015;
/// Largest height difference at which the grip site still touches the object, in meters.
const GRIP_REACH: f64 = 0.03;
/// A finger's joint position when the gripper is open, in meters.
const FINGER_OPEN: f64 = 0.05;
/// Largest speed of a finger, in meters per second: 0.04 m in one control step of 0.04 s.
const FINGER_SPEED: f64 = 1.0;
/// Deceleration of a sliding puck, in meters per second squared.
const SLIDE_FRICTION: f64 = 1.0;
/// Free fall, in meters per second squared.
const GRAVITY: f64 = 9.81;

/// The kinematic simulator: a gripper that follows its commands, and an object that is pushed,
/// carried, dropped and slid by simple rules.
///
/// It needs no library, costs almost nothing and gives the same bits on every machine, so code
/// built on a [`Simulator`] can be tested without MuJoCo. It starts where the real scenes settle,
/// but its trajectories are not the benchmark's: do not publish results obtained with it.
///
/// The simulator is its own snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Saved")]
pub struct KinematicSimulator {
    config: SimConfig,
    gripper: GripperState,
    object: Option<Object>,
    physics: Physics,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Object {
    position: Vector3<f64>,
    /// Mean velocity over the last control step, as observed.
    velocity: Vector3<f64>,
    /// Current velocity, with which it keeps sliding or falling.
    motion: Vector3<f64>,
}

impl Object {
    fn numbers(&self) -> impl Iterator<Item = &f64> {
        self.position.iter().chain(&self.velocity).chain(&self.motion)
    }
}

impl KinematicSimulator {
    /// Creates a simulator in the settled state.
    #[must_use]
    pub fn new(config: &SimConfig) -> Self {
        let spec = config.task().spec();
        Self {
            config: config.clone(),
            gripper: GripperState {
                position: spec.gripper_start.into(),
                ..GripperState::default()
            },
            object: spec.object.map(|object| Object {
                position: object.settled_at.into(),
                velocity: Vector3::zeros(),
                motion: Vector3::zeros(),
            }),
            physics: Physics::default(),
        }
    }

    /// Advances by one substep; displacements in meters.
    fn substep(&mut self, displacement: Vector3<f64>, finger_displacement: f64) {
        let before = self.gripper.position;
        for (axis, [low, high]) in REACHABLE.into_iter().enumerate() {
            let moved = self.gripper.position[axis] + displacement[axis];
            self.gripper.position[axis] = moved.clamp(low, high);
        }
        let held = self.object.is_some_and(|object| self.between_fingers(&object));
        let closed = if held { OBJECT_RADIUS } else { 0.0 };
        let limit = FINGER_SPEED * TIME_STEP;
        for finger in &mut self.gripper.finger_positions {
            let change = finger_displacement.clamp(-limit, limit);
            *finger = (*finger + change).clamp(closed.min(*finger), FINGER_OPEN);
        }
        let Some(mut object) = self.object else { return };
        let moved = self.gripper.position - before;
        let grasped = held && self.gripper.finger_positions.iter().all(|&q| q <= OBJECT_RADIUS);
        if grasped {
            object.position += moved;
            object.position.z = object.position.z.max(self.support(&object));
            object.motion = Vector3::zeros();
        } else {
            self.slide_and_fall(&mut object);
            if !held {
                self.push(&mut object, moved / TIME_STEP);
            }
        }
        self.object = Some(object);
    }

    /// Returns whether the fingers can close on the object.
    fn between_fingers(&self, object: &Object) -> bool {
        let offset = object.position - self.gripper.position;
        // Blocked fingers never open, so nothing fits between them.
        !self.config.task().block_gripper()
            && self.gripper.finger_positions.iter().all(|&q| q >= OBJECT_RADIUS)
            && offset.iter().all(|distance| distance.abs() <= GRIP_REACH)
    }

    /// Moves the object out of the gripper's way, along the axis that needs the shortest move.
    fn push(&self, object: &mut Object, gripper_motion: Vector3<f64>) {
        let reach = OBJECT_RADIUS + GRIPPER_RADIUS;
        let offset = object.position - self.gripper.position;
        if offset.x.abs() >= reach || offset.y.abs() >= reach || offset.z.abs() > GRIP_REACH {
            return;
        }
        let axis = if offset.x.abs() > offset.y.abs() { 0 } else { 1 };
        object.position[axis] = self.gripper.position[axis] + reach.copysign(offset[axis]);
        if self.config.task().spec().object.is_some_and(|spec| spec.slides) {
            object.motion[axis] = gripper_motion[axis];
        }
    }

    /// Returns the height at which the object comes to rest below its position: on the table or on
    /// the floor.
    fn support(&self, object: &Object) -> f64 {
        let on_table = |spec: &ObjectSpec| {
            spec.table
                .iter()
                .zip(&object.position)
                .all(|([low, high], at)| (*low..=*high).contains(at))
        };
        let spec = self.config.task().spec().object.filter(on_table);
        spec.map_or(OBJECT_RADIUS, |spec| spec.settled_at[2])
    }

    fn slide_and_fall(&self, object: &mut Object) {
        let speed = object.motion.xy().norm();
        let friction = SLIDE_FRICTION * self.physics.scale(PhysicsFactor::Friction);
        let slower = (speed - friction * TIME_STEP).max(0.0);
        let keep = if speed > 0.0 { slower / speed } else { 0.0 };
        object.motion.x *= keep;
        object.motion.y *= keep;
        object.motion.z -= self.physics.get(PhysicsFactor::Gravity).unwrap_or(GRAVITY) * TIME_STEP;
        object.position += object.motion * TIME_STEP;
        let support = self.support(object);
        if object.position.z <= support {
            object.position.z = support;
            object.motion.z = 0.0;
        }
    }
}

impl Simulator for KinematicSimulator {
    type Snapshot = Self;

    fn task(&self) -> Task {
        self.config.task()
    }

    fn control_period(&self) -> f64 {
        f64::from(self.config.n_substeps().get()) * TIME_STEP
    }

    fn settled(&self) -> Settled {
        let spec = self.task().spec();
        Settled {
            gripper_position: spec.gripper_start.into(),
            object_height: spec.object.map(|object| object.settled_at[2]),
        }
    }

    fn reset(&mut self, object_xy: Option<[f64; 2]>) -> Result<(), SimError> {
        self.reset_varied(object_xy, &Physics::default())
    }

    /// The friction of a sliding object and the gravity can vary.
    fn can_vary(&self, factor: PhysicsFactor) -> Result<(), SimError> {
        if matches!(factor, PhysicsFactor::Friction | PhysicsFactor::Gravity) {
            return Ok(());
        }
        let reason = "the kinematic simulator varies only friction and gravity";
        Err(SimError::CannotVary { factor: factor.name(), reason })
    }

    fn physics(&self) -> Physics {
        self.physics
    }

    fn reset_varied(
        &mut self,
        object_xy: Option<[f64; 2]>,
        physics: &Physics,
    ) -> Result<(), SimError> {
        physics.iter().try_for_each(|(factor, _)| self.can_vary(factor))?;
        let mut settled = Self { physics: *physics, ..Self::new(&self.config) };
        if let Some([x, y]) = object_xy {
            let object =
                settled.object.as_mut().ok_or(SimError::NoObject { task: self.config.task() })?;
            check_object_position([x, y])?;
            object.position.x = x;
            object.position.y = y;
        }
        *self = settled;
        Ok(())
    }

    /// The object does not turn.
    fn place_task_object(
        &mut self,
        position: Vector3<f64>,
        orientation: UnitQuaternion<f64>,
    ) -> Result<(), SimError> {
        let no_object = SimError::NoObject { task: self.task() };
        let object = self.object.as_mut().ok_or(no_object)?;
        check_inside("the pose of a body", position.iter().chain(&orientation.coords))?;
        if orientation != UnitQuaternion::identity() {
            let reason = "the kinematic simulator's object does not turn";
            return Err(SimError::CannotVary { factor: "object_rotation", reason });
        }
        *object = Object { position, velocity: Vector3::zeros(), motion: Vector3::zeros() };
        Ok(())
    }

    fn step(&mut self, control: &Control) -> Result<(), SimError> {
        control.check()?;
        let (gripper, object) = (self.gripper, self.object);
        let fingers = if self.config.task().block_gripper() { 0.0 } else { control.fingers };
        let n_substeps = self.config.n_substeps().get();
        let share = 1.0 / f64::from(n_substeps);
        for _ in 0..n_substeps {
            self.substep(control.displacement * share, fingers * share);
        }
        let period = self.control_period();
        self.gripper.velocity = (self.gripper.position - gripper.position) / period;
        for finger in 0..2 {
            let moved = self.gripper.finger_positions[finger] - gripper.finger_positions[finger];
            self.gripper.finger_velocities[finger] = moved / period;
        }
        if let (Some(now), Some(then)) = (&mut self.object, object) {
            now.velocity = (now.position - then.position) / period;
        }
        Ok(())
    }

    fn gripper(&self) -> GripperState {
        self.gripper
    }

    fn object(&self) -> Option<ObjectState> {
        self.object.map(|object| ObjectState {
            position: object.position,
            rotation: Matrix3::identity(),
            linear_velocity: object.velocity,
            angular_velocity: Vector3::zeros(),
        })
    }

    fn snapshot(&self) -> Self {
        self.clone()
    }

    fn restore(&mut self, snapshot: &Self) -> Result<(), SimError> {
        if !snapshot.config.same_physics(&self.config) {
            let (theirs, ours) = (&snapshot.config, &self.config);
            return Err(SimError::ForeignSnapshot {
                reason: format!("it was taken from {theirs:?}, this is {ours:?}"),
            });
        }
        self.clone_from(snapshot);
        Ok(())
    }
}

/// The serialized form before its checks.
#[derive(Deserialize)]
#[serde(rename = "KinematicSimulator")]
struct Saved {
    config: SimConfig,
    gripper: GripperState,
    object: Option<Object>,
    #[serde(default)]
    physics: Physics,
}

impl TryFrom<Saved> for KinematicSimulator {
    type Error = SimError;

    fn try_from(Saved { config, gripper, object, physics }: Saved) -> Result<Self, SimError> {
        let foreign = |reason| Err(SimError::ForeignSnapshot { reason });
        if object.is_some() != config.task().has_object() {
            return foreign(format!("its object is {object:?}, the task is {}", config.task()));
        }
        let numbers = object.iter().flat_map(Object::numbers).chain(gripper.numbers());
        if let Some(number) = first_outside(numbers) {
            return foreign(format!("it contains the number {number}"));
        }
        let mut coordinates = gripper.position.iter().zip(REACHABLE);
        let is_reachable = coordinates.all(|(at, [low, high])| (low..=high).contains(at));
        let fingers = gripper.finger_positions;
        if !is_reachable || !fingers.iter().all(|q| (0.0..=FINGER_OPEN).contains(q)) {
            return foreign(format!("its gripper cannot be at {gripper:?}"));
        }
        let simulator = Self { config, gripper, object, physics };
        let varies = |(factor, _)| simulator.can_vary(factor);
        match physics.iter().try_for_each(varies) {
            Ok(()) => Ok(simulator),
            Err(error) => foreign(error.to_string()),
        }
    }
}
