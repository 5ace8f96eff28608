//! The four Fetch tasks; each has a file that describes it.

mod pick_and_place;
mod push;
mod reach;
mod slide;
pub(crate) mod spec;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use self::spec::{GoalSpec, ObjectSpec, TaskSpec};
use self::{pick_and_place::PICK_AND_PLACE, push::PUSH, reach::REACH, slide::SLIDE};

/// The four Fetch tasks, each with its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// Move the gripper to a point in the air; no object.
    Reach,
    /// Push a cube to a point on the table, gripper closed.
    Push,
    /// Lift a cube to a point on the table or in the air.
    PickAndPlace,
    /// Hit a puck so that it slides to a point out of reach, gripper closed.
    Slide,
}

impl Task {
    /// All tasks, in the order in which tables list them.
    pub const ALL: [Self; 4] = [Self::Reach, Self::Push, Self::PickAndPlace, Self::Slide];

    /// Returns the task's description.
    #[must_use]
    pub const fn spec(self) -> &'static TaskSpec {
        match self {
            Self::Reach => &REACH,
            Self::Push => &PUSH,
            Self::PickAndPlace => &PICK_AND_PLACE,
            Self::Slide => &SLIDE,
        }
    }

    /// Returns the task's name as environment ids spell it, such as `PickAndPlace`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.spec().name
    }

    /// Returns whether the scene holds an object to move.
    #[must_use]
    pub const fn has_object(self) -> bool {
        self.spec().object.is_some()
    }

    /// Returns whether the fingers are held closed, so that `action[3]` has no effect.
    #[must_use]
    pub const fn block_gripper(self) -> bool {
        self.spec().block_gripper
    }
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
