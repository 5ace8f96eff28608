use std::fmt;

use serde::{Deserialize, Serialize};

/// The four Fetch tasks, each with a scene of its own.
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

    /// The task's name as environment ids spell it, such as `PickAndPlace`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reach => "Reach",
            Self::Push => "Push",
            Self::PickAndPlace => "PickAndPlace",
            Self::Slide => "Slide",
        }
    }

    /// Whether the scene holds an object to move.
    #[must_use]
    pub const fn has_object(self) -> bool {
        !matches!(self, Self::Reach)
    }

    /// Whether the fingers are held closed, so that `action[3]` has no effect.
    #[must_use]
    pub const fn block_gripper(self) -> bool {
        !matches!(self, Self::PickAndPlace)
    }
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
