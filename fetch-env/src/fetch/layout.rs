//! The layout of an observation: its fields, and their positions in each task.

use std::ops::Range;

use fetch_sim::Task;
use serde::Serialize;

use super::variation::interface::InterfaceFactor;

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
    /// Short form of the description, for labels.
    pub summary: &'static str,
    /// What kind of vector the elements are.
    #[serde(skip)]
    pub(super) kind: Kind,
    /// The factor of the elements' noise.
    #[serde(skip)]
    pub(super) noise: InterfaceFactor,
}

/// The kinds of vectors in observations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A point in the world.
    Position,
    /// A difference of two points, or a velocity.
    Difference,
    /// Rotations about the axes: angles, or angular velocities.
    Turn,
    /// One number per finger, right and left.
    Fingers,
}

impl Kind {
    /// Returns the number of elements.
    const fn len(self) -> usize {
        match self {
            Self::Position | Self::Difference | Self::Turn => 3,
            Self::Fingers => 2,
        }
    }
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

const EVERY_TASK: bool = false;
const WITH_OBJECT: bool = true;

/// Every field in the order of the observation: the tasks that have it, its name, kind, unit and
/// meaning.
///
/// Source: `_get_obs` of gymnasium-robotics 1.4.2; its own table says "m/s".
const ROWS: [(bool, &str, Kind, &str, &str); 9] = [
    (EVERY_TASK, "grip_pos", Kind::Position, "m", "position of the grip site, between the fingers"),
    (WITH_OBJECT, "object_pos", Kind::Position, "m", "position of the object's center"),
    (
        WITH_OBJECT,
        "object_rel_pos",
        Kind::Difference,
        "m",
        "position of the object relative to the gripper",
    ),
    (
        EVERY_TASK,
        "gripper_state",
        Kind::Fingers,
        "m",
        "right and left finger joint, 0 closed to 0.05 open",
    ),
    (WITH_OBJECT, "object_rot", Kind::Turn, "rad", "XYZ Euler angles of the object"),
    (
        WITH_OBJECT,
        "object_velp",
        Kind::Difference,
        "m/step",
        "velocity of the object relative to the gripper",
    ),
    (WITH_OBJECT, "object_velr", Kind::Turn, "rad/step", "angular velocity of the object"),
    (EVERY_TASK, "grip_velp", Kind::Difference, "m/step", "velocity of the grip site"),
    (
        EVERY_TASK,
        "gripper_vel",
        Kind::Fingers,
        "m/step",
        "velocities of the right and left finger joint",
    ),
];

/// The summary of every field, in the order of [`ROWS`].
const SUMMARIES: [&str; ROWS.len()] = [
    "gripper's position",
    "object's position",
    "object's, from the gripper",
    "fingers, 0 is closed",
    "object's Euler angles",
    "object's, from the gripper",
    "object's rotation",
    "gripper's velocity",
    "fingers' velocities",
];

/// Places the `N` fields of an observation with or without an object one after another.
const fn fields<const N: usize>(has_object: bool) -> [ObservationField; N] {
    const EMPTY: ObservationField = ObservationField {
        name: "",
        range: 0..0,
        unit: "",
        description: "",
        summary: "",
        kind: Kind::Position,
        noise: InterfaceFactor::GripPosNoise,
    };
    let mut fields = [EMPTY; N];
    let (mut row, mut field, mut start) = (0, 0, 0);
    while row < ROWS.len() {
        let (needs_object, name, kind, unit, description) = ROWS[row];
        if has_object || !needs_object {
            let (range, summary) = (start..start + kind.len(), SUMMARIES[row]);
            start = range.end;
            // They are in the order of the rows.
            let noise = InterfaceFactor::ALL[InterfaceFactor::GripPosNoise as usize + row];
            fields[field] =
                ObservationField { name, range, unit, description, summary, kind, noise };
            field += 1;
        }
        row += 1;
    }
    assert!(field == N, "the array has one element per field");
    fields
}

/// Returns the index of a field's first element. Call it in a `const` block: an unknown name is
/// then a compile error.
pub(super) const fn start(fields: &[ObservationField], name: &str) -> usize {
    let mut field = 0;
    // `==` is not const yet; the names are in lower case.
    while !fields[field].name.eq_ignore_ascii_case(name) {
        field += 1;
    }
    fields[field].range.start
}
