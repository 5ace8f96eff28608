//! What a task in Python sees of the simulations.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use fetch_env::fetch_sim::{GripperState, ObjectState};
use fetch_env::{MujocoSimulator, SimError, Simulator};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;

use crate::arrays::Numbers;
use crate::error::{Error, Result};

/// How far a product of a rotation matrix with its inverse may be from the identity.
const ROUNDING: f64 = 1e-6;

/// What a task sees of one simulation.
pub(crate) struct Seen {
    gripper: GripperState,
    /// Of the bodies with the names of a [`Sim`].
    objects: Vec<ObjectState>,
}

impl Seen {
    pub(super) fn of(simulator: &MujocoSimulator, names: &[String]) -> Result<Self, SimError> {
        let objects = names.iter().map(|name| simulator.object_state(name));
        Ok(Self { gripper: simulator.gripper(), objects: objects.collect::<Result<_, _>>()? })
    }
}

/// A body that a task has placed.
pub(super) struct Place {
    pub(super) name: String,
    pub(super) position: Vector3<f64>,
    pub(super) rotation: UnitQuaternion<f64>,
}

/// The simulations of one or many environments, as a task sees them: use it in the method that got it.
///
/// Arrays are new, of `float64`, in the world frame, with a leading axis of N environments. In
/// `begin_episode` they have none.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Sim {
    names: Arc<[String]>,
    /// Whether it is of the one environment whose episode begins: arrays then have no leading axis,
    /// and bodies can be placed.
    is_one: bool,
    states: Mutex<States>,
}

#[derive(Default)]
struct States {
    seen: Vec<Seen>,
    places: Vec<Place>,
}

#[pymethods]
impl Sim {
    /// The names of the bodies, without the robot's.
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.names.iter().map(|name| &**name).collect()
    }

    /// The positions of a body: (N, 3) in meters.
    fn position<'py>(&self, py: Python<'py>, name: &str) -> Result<Array<'py>> {
        self.object(py, name, |object| object.position.into())
    }

    /// The rotation matrices of a body: (N, 3, 3).
    fn rotation<'py>(&self, py: Python<'py>, name: &str) -> Result<Array<'py>> {
        let body = self.body(name)?;
        self.array(py, &[3, 3], |seen| {
            // Row after row; nalgebra stores columns.
            let mut rows = [0.0; 9];
            rows.copy_from_slice(seen.objects[body].rotation.transpose().as_slice());
            rows
        })
    }

    /// The velocities of a body: (N, 3) in meters per second.
    fn velocity<'py>(&self, py: Python<'py>, name: &str) -> Result<Array<'py>> {
        self.object(py, name, |object| object.linear_velocity.into())
    }

    /// The angular velocities of a body: (N, 3) in radians per second.
    fn angular_velocity<'py>(&self, py: Python<'py>, name: &str) -> Result<Array<'py>> {
        self.object(py, name, |object| object.angular_velocity.into())
    }

    /// The positions of the gripper: (N, 3) in meters.
    fn gripper<'py>(&self, py: Python<'py>) -> Result<Array<'py>> {
        self.array(py, &[3], |seen| seen.gripper.position.into())
    }

    /// The velocities of the gripper: (N, 3) in meters per second.
    fn gripper_velocity<'py>(&self, py: Python<'py>) -> Result<Array<'py>> {
        self.array(py, &[3], |seen| seen.gripper.velocity.into())
    }

    /// The positions of the right and the left finger: (N, 2) in meters.
    fn fingers<'py>(&self, py: Python<'py>) -> Result<Array<'py>> {
        self.array(py, &[2], |seen| seen.gripper.finger_positions)
    }

    /// In `begin_episode`, places a body that has a free joint, at rest, or a mocap body: at x, y, z
    /// in meters, not turned, or by a rotation matrix of shape (3, 3).
    #[pyo3(signature = (name, position, rotation = None))]
    fn place(
        &self,
        name: &str,
        position: &Bound<'_, PyAny>,
        rotation: Option<&Bound<'_, PyAny>>,
    ) -> Result<()> {
        if !self.is_one {
            return Err(Error::runtime("bodies are placed in begin_episode() alone"));
        }
        let body = self.body(name)?;
        let position = Numbers::of_shape("position", position, &[3])?.to_double();
        let rotation = match rotation {
            None => Matrix3::identity(),
            Some(rotation) => {
                let rows = Numbers::of_shape("rotation", rotation, &[3, 3])?.to_double();
                let matrix = Matrix3::from_row_slice(&rows);
                let error = (matrix.transpose() * matrix - Matrix3::identity()).norm();
                if !(error < ROUNDING && matrix.determinant() > 0.0) {
                    let wrong = "rotation is no rotation matrix: pass one whose rows are of length 1 \
                                 and perpendicular, without a mirror";
                    return Err(Error::value(wrong));
                }
                matrix
            }
        };
        let position = Vector3::from_column_slice(&position);
        let mut states = self.states();
        let Some(seen) = states.seen.first_mut() else { return Err(over()) };
        seen.objects[body] = ObjectState { position, rotation, ..ObjectState::default() };
        let rotation = Rotation3::from_matrix_unchecked(rotation);
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        states.places.push(Place { name: name.to_owned(), position, rotation });
        Ok(())
    }
}

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

impl Sim {
    pub(super) fn of_one(names: Arc<[String]>, seen: Seen) -> Self {
        Self { is_one: true, ..Self::of_many(names, vec![seen]) }
    }

    pub(super) fn of_many(names: Arc<[String]>, seen: Vec<Seen>) -> Self {
        Self { names, is_one: false, states: Mutex::new(States { seen, places: Vec::new() }) }
    }

    /// Ends the call that got it, and returns the bodies that it has placed.
    pub(super) fn end(&self) -> Vec<Place> {
        std::mem::take(&mut *self.states()).places
    }

    fn states(&self) -> MutexGuard<'_, States> {
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn body(&self, name: &str) -> Result<usize> {
        self.names.iter().position(|known| known == name).ok_or_else(|| {
            let names = self.names.join(", ");
            Error::value(format!("there is no body {name:?}: the bodies are {names}"))
        })
    }

    fn object<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        numbers: impl Fn(&ObjectState) -> [f64; 3],
    ) -> Result<Array<'py>> {
        let body = self.body(name)?;
        self.array(py, &[3], |seen| numbers(&seen.objects[body]))
    }

    /// Returns numbers of each environment, with a leading axis unless it is of one.
    fn array<'py, const N: usize>(
        &self,
        py: Python<'py>,
        shape: &[usize],
        numbers: impl Fn(&Seen) -> [f64; N],
    ) -> Result<Array<'py>> {
        let rows: Vec<[f64; N]> = self.states().seen.iter().map(numbers).collect();
        if rows.is_empty() {
            return Err(over());
        }
        let leading = if self.is_one { None } else { Some(rows.len()) };
        let shape: Vec<usize> = leading.into_iter().chain(shape.iter().copied()).collect();
        Ok(PyArray1::from_slice(py, rows.as_flattened()).reshape(shape)?)
    }
}

fn over() -> Error {
    Error::runtime("the simulation has gone on: use sim in the method that got it")
}
