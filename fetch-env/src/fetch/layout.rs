//! The layout of an observation: its fields, and where each task has them.

use std::ops::Range;

use fetch_sim::Task;
use serde::Serialize;

/// Consecutive elements of `observation` with one meaning.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ObservationField {
    /// The reference's name of the field.
    pub name: &'static str,
    /// Indices of its elements.
    pub range: Range<usize>,
    /// Unit of the elements.
    pub unit: &'static str,
    /// Meaning of the elements.
    pub description: &'static str,
    /// The meaning in as few words as possible, for tables and figures.
    #[serde(skip)]
    pub summary: &'static str,
}

impl ObservationField {
    /// Returns the field of this name; `None` if the task's observations do not have it.
    #[must_use]
    pub fn find(task: Task, name: &str) -> Option<&'static Self> {
        observation_fields(task).iter().find(|field| field.name == name)
    }
}

/// Returns the fields of a task's `observation`, in order and without gaps; see
/// [`FetchObservation`](super::observation::FetchObservation).
#[must_use]
pub const fn observation_fields(task: Task) -> &'static [ObservationField] {
    if task.has_object() { &OBJECT } else { &REACH }
}

/// The fields of an observation without an object.
pub(super) const REACH: [ObservationField; 4] = fields(false);
/// The fields of an observation with an object.
pub(super) const OBJECT: [ObservationField; 9] = fields(true);

/// A field before it has a place.
struct Row {
    name: &'static str,
    len: usize,
    /// Whether only tasks with an object have the field.
    object: bool,
    unit: &'static str,
    description: &'static str,
    summary: &'static str,
}

/// Every field, in the order of the observation.
///
/// Source: `_get_obs` of gymnasium-robotics 1.4.2; its own table says "m/s".
const ROWS: [Row; 9] = [
    Row {
        name: "grip_pos",
        len: 3,
        object: false,
        unit: "m",
        description: "position of the grip site, between the fingers",
        summary: "gripper's position",
    },
    Row {
        name: "object_pos",
        len: 3,
        object: true,
        unit: "m",
        description: "position of the object's center",
        summary: "object's position",
    },
    Row {
        name: "object_rel_pos",
        len: 3,
        object: true,
        unit: "m",
        description: "position of the object relative to the gripper",
        summary: "object's, from the gripper",
    },
    Row {
        name: "gripper_state",
        len: 2,
        object: false,
        unit: "m",
        description: "right and left finger joint, 0 closed to 0.05 open",
        summary: "fingers, 0 is closed",
    },
    Row {
        name: "object_rot",
        len: 3,
        object: true,
        unit: "rad",
        description: "XYZ Euler angles of the object",
        summary: "object's Euler angles",
    },
    Row {
        name: "object_velp",
        len: 3,
        object: true,
        unit: "m/step",
        description: "velocity of the object relative to the gripper",
        summary: "object's, from the gripper",
    },
    Row {
        name: "object_velr",
        len: 3,
        object: true,
        unit: "rad/step",
        description: "angular velocity of the object",
        summary: "object's rotation",
    },
    Row {
        name: "grip_velp",
        len: 3,
        object: false,
        unit: "m/step",
        description: "velocity of the grip site",
        summary: "gripper's velocity",
    },
    Row {
        name: "gripper_vel",
        len: 2,
        object: false,
        unit: "m/step",
        description: "velocities of the right and left finger joint",
        summary: "fingers' velocities",
    },
];

/// Places the `N` fields of an observation with or without an object one after another.
const fn fields<const N: usize>(has_object: bool) -> [ObservationField; N] {
    let mut fields = [const {
        ObservationField { name: "", range: 0..0, unit: "", description: "", summary: "" }
    }; N];
    let (mut row, mut field, mut start) = (0, 0, 0);
    while row < ROWS.len() {
        let Row { name, len, object, unit, description, summary } = ROWS[row];
        if has_object || !object {
            fields[field] =
                ObservationField { name, range: start..start + len, unit, description, summary };
            field += 1;
            start += len;
        }
        row += 1;
    }
    assert!(field == N, "the array has one element per field");
    fields
}

/// Returns the number of elements of an observation.
pub(super) const fn len(fields: &[ObservationField]) -> usize {
    fields[fields.len() - 1].range.end
}

/// Returns the index of a field's first element. Call it in a `const` block: an unknown name is then
/// a compile error.
pub(super) const fn start(fields: &[ObservationField], name: &str) -> usize {
    let mut field = 0;
    while !equal(fields[field].name, name) {
        field += 1;
    }
    fields[field].range.start
}

/// Compares two strings, as `==` cannot yet in a `const fn`.
const fn equal(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut same = 0;
    while same < a.len() && same < b.len() && a[same] == b[same] {
        same += 1;
    }
    same == a.len() && same == b.len()
}
