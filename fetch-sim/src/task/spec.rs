//! The description of a task: every number in which the tasks differ.

use crate::object::ObjectShape;

/// Everything that distinguishes one Fetch task from the others.
///
/// [`Task::spec`](super::Task::spec) returns it. Positions are in meters in the world frame (x
/// forward from the robot's base, y to its left, z up).
///
/// Source: the constructors in `envs/fetch/*.py` of gymnasium-robotics 1.4.2.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TaskSpec {
    /// The task's name as environment ids spell it.
    pub name: &'static str,
    /// File name of the scene, in this crate and in the reference.
    pub scene_file: &'static str,
    /// MJCF of the built-in scene.
    #[cfg(feature = "mujoco")]
    pub(crate) scene_xml: &'static str,
    /// Initial positions of the base joints `robot0:slide0` to `robot0:slide2`, in meters.
    pub base_position: [f64; 3],
    /// Height added to the gripper's first target, in meters.
    pub gripper_extra_height: f64,
    /// Position of the grip site once the scene has settled.
    pub gripper_start: [f64; 3],
    /// Whether the fingers are held closed, so that `action[3]` has no effect.
    pub block_gripper: bool,
    /// The object to move; `None` if the gripper itself has to reach the goal.
    pub object: Option<ObjectSpec>,
    /// The distribution of desired goals.
    pub goal: GoalSpec,
}

/// The object of a task.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ObjectSpec {
    /// Its form.
    pub shape: ObjectShape,
    /// Its mass, in kilograms.
    pub mass: f64,
    /// Its coefficient of sliding friction.
    pub friction: f64,
    /// Position from which the object falls onto the table while the scene settles.
    pub dropped_at: [f64; 3],
    /// Position of the object's center once the scene has settled.
    pub settled_at: [f64; 3],
    /// Largest distance between the object's start and the gripper's in x and in y, in meters.
    pub range: f64,
    /// Extent of the table's top in x and in y, in meters.
    pub(crate) table: [[f64; 2]; 2],
    /// Whether the object keeps sliding after a hit.
    pub(crate) slides: bool,
}

impl ObjectSpec {
    /// The cube of Push and PickAndPlace.
    pub(super) const CUBE: Self = Self {
        shape: ObjectShape::Box { half_size: [0.025; 3] },
        mass: 2.0,
        friction: 1.0,
        dropped_at: [1.25, 0.53, 0.4],
        settled_at: [1.25, 0.53, 0.424_699_749_459_536],
        range: 0.15,
        table: [[1.05, 1.55], [0.4, 1.1]],
        slides: false,
    };
}

/// The distribution of a task's desired goals.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct GoalSpec {
    /// Largest distance along each axis between the goal and the gripper's start plus
    /// [`offset`](Self::offset), in meters.
    pub range: f64,
    /// Offset of every goal, in meters.
    pub offset: [f64; 3],
    /// Whether half of the goals are raised above the table.
    pub in_the_air: bool,
}
