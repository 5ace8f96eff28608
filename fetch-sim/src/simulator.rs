//! The simulator trait, and the states and commands that it exchanges with an environment.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::{
    error::SimError,
    physics::{Physics, PhysicsFactor},
    task::Task,
};

/// A simulated Fetch robot, as an environment needs it.
///
/// One value is one robot in one scene. Positions are meters in the world frame (x forward from
/// the base, y to its left, z up), velocities meters or radians per second.
///
/// A failed call leaves the simulation in an unspecified but valid state: call
/// [`reset`](Self::reset) or [`restore`](Self::restore) before anything else.
///
/// ```
/// use fetch_sim::{Control, KinematicSimulator, SimConfig, SimError, Simulator, Task};
/// use nalgebra::Vector3;
///
/// /// Moves the gripper by `displacement` (meters) ten times, and returns how far it got.
/// fn reach<S: Simulator>(simulator: &mut S, displacement: Vector3<f64>) -> Result<f64, SimError> {
///     simulator.reset(None)?;
///     for _ in 0..10 {
///         simulator.step(&Control { displacement, fingers: 0.0 })?;
///     }
///     Ok((simulator.gripper().position - simulator.settled().gripper_position).norm())
/// }
///
/// let mut simulator = KinematicSimulator::new(&SimConfig::new(Task::Reach));
/// let start = simulator.snapshot();
/// let distance = reach(&mut simulator, Vector3::new(0.0, 0.01, 0.0))?;
/// assert!((distance - 0.1).abs() < 1e-9);
/// simulator.restore(&start)?; // exact to the last bit
/// # Ok::<(), SimError>(())
/// ```
pub trait Simulator {
    /// The complete state of a simulation, exact to the last bit.
    type Snapshot: Clone + std::fmt::Debug + PartialEq + Serialize + DeserializeOwned;

    /// Returns the task whose scene is simulated.
    fn task(&self) -> Task;

    /// Returns the duration of one control step, in seconds: substeps times the physics time step.
    fn control_period(&self) -> f64;

    /// Returns where the gripper and the object rest in the settled scene; the same after every
    /// reset.
    fn settled(&self) -> Settled;

    /// Returns to the settled state, with the object at `object_xy` (meters).
    ///
    /// `None` leaves the object where it settled. The object keeps its settled height and
    /// orientation.
    ///
    /// # Errors
    /// [`SimError::NoObject`] if the scene has no object to place, [`SimError::OutOfRange`] if a
    /// coordinate is NaN or exceeds [`LARGEST_NUMBER`](crate::LARGEST_NUMBER); the simulation is
    /// then unchanged.
    fn reset(&mut self, object_xy: Option<[f64; 2]>) -> Result<(), SimError>;

    /// Returns to the settled state as [`reset`](Self::reset) does, with other physics until the next
    /// reset. An object of another size stands on the table. Where this simulator varies nothing, as
    /// by default, `physics` must be empty.
    ///
    /// # Errors
    /// [`SimError::CannotVary`], and as [`reset`](Self::reset). After the first, the simulation is
    /// unchanged.
    fn reset_varied(
        &mut self,
        object_xy: Option<[f64; 2]>,
        physics: &Physics,
    ) -> Result<(), SimError> {
        physics.iter().try_for_each(|(factor, _)| self.can_vary(factor))?;
        self.reset(object_xy)
    }

    /// Checks that [`reset_varied`](Self::reset_varied) can vary a number.
    ///
    /// # Errors
    /// [`SimError::CannotVary`].
    fn can_vary(&self, factor: PhysicsFactor) -> Result<(), SimError> {
        Err(SimError::CannotVary { factor: factor.name(), reason: "this simulator varies nothing" })
    }

    /// Returns the numbers of the physics that differ from the model's: none by default.
    fn physics(&self) -> Physics {
        Physics::default()
    }

    /// Places the task's object at rest. `position` (meters) and `orientation` are those of its
    /// body's frame in the world frame.
    ///
    /// # Errors
    /// [`SimError::NoObject`] if the scene has no object, [`SimError::OutOfRange`] if a number is
    /// NaN or exceeds [`LARGEST_NUMBER`](crate::LARGEST_NUMBER), [`SimError::CannotVary`] if the
    /// simulator's object does not turn; the simulation is then unchanged.
    fn place_task_object(
        &mut self,
        position: Vector3<f64>,
        orientation: UnitQuaternion<f64>,
    ) -> Result<(), SimError>;

    /// Simulates one control step.
    ///
    /// # Errors
    /// [`SimError::Unstable`] if the physics diverged, or if the control is not finite.
    fn step(&mut self, control: &Control) -> Result<(), SimError>;

    /// Returns the gripper as the environment observes it.
    fn gripper(&self) -> GripperState;

    /// Returns the object as the environment observes it; `None` for [`Task::Reach`].
    fn object(&self) -> Option<ObjectState>;

    /// Returns everything that determines the rest of the simulation.
    fn snapshot(&self) -> Self::Snapshot;

    /// Returns to a snapshot of a simulator with the same configuration.
    ///
    /// # Errors
    /// [`SimError::ForeignSnapshot`] if the snapshot is of another kind of simulation, or if one of
    /// its numbers is NaN or exceeds [`LARGEST_NUMBER`](crate::LARGEST_NUMBER). After any error the
    /// simulation is as it was.
    fn restore(&mut self, snapshot: &Self::Snapshot) -> Result<(), SimError>;
}

/// The settled scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Position of the grip site, in meters.
    pub gripper_position: Vector3<f64>,
    /// Height of the object's center above the floor, in meters; `None` without an object.
    pub object_height: Option<f64>,
}

/// The command of one control step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// Displacement of the gripper's target from its current position, in meters.
    pub displacement: Vector3<f64>,
    /// Displacement of both fingers' targets, in meters; positive opens. It has no effect if the
    /// gripper is blocked.
    pub fingers: f64,
}

impl Control {
    pub(crate) fn check(&self) -> Result<(), SimError> {
        if self.displacement.iter().chain([&self.fingers]).all(|value| value.is_finite()) {
            return Ok(());
        }
        Err(SimError::Unstable { reason: format!("{self:?} is not finite") })
    }
}

/// State of the gripper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GripperState {
    /// Position of the grip site, in meters.
    pub position: Vector3<f64>,
    /// Linear velocity of the grip site, in meters per second.
    pub velocity: Vector3<f64>,
    /// Right and left finger joint positions, in meters; 0 is closed.
    pub finger_positions: [f64; 2],
    /// Right and left finger joint velocities, in meters per second.
    pub finger_velocities: [f64; 2],
}

impl GripperState {
    pub(crate) fn numbers(&self) -> impl Iterator<Item = &f64> {
        let Self { position, velocity, finger_positions, finger_velocities } = self;
        position.iter().chain(velocity).chain(finger_positions).chain(finger_velocities)
    }
}

/// State of the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectState {
    /// Position of the object's center, in meters.
    pub position: Vector3<f64>,
    /// Orientation: the columns are the object's axes in the world frame.
    pub rotation: Matrix3<f64>,
    /// Linear velocity, in meters per second.
    pub linear_velocity: Vector3<f64>,
    /// Angular velocity, in radians per second.
    pub angular_velocity: Vector3<f64>,
}

impl ObjectState {
    #[cfg(feature = "mujoco")]
    pub(crate) fn numbers(&self) -> impl Iterator<Item = &f64> {
        let Self { position, rotation, linear_velocity, angular_velocity } = self;
        position.iter().chain(rotation).chain(linear_velocity).chain(angular_velocity)
    }
}
