//! The form of a task's object.

use serde::{Deserialize, Serialize};

/// The form of a task's object, with sizes in meters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ObjectShape {
    /// A box.
    Box {
        /// Half of its extent along each axis.
        half_size: [f64; 3],
    },
    /// A ball.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// An upright cylinder.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// Half of its height.
        half_length: f64,
    },
}

impl ObjectShape {
    /// Returns the sizes in the order of MJCF; the last one is half of the height.
    pub(crate) const fn sizes(self) -> [f64; 3] {
        match self {
            Self::Box { half_size } => half_size,
            Self::Sphere { radius } => [radius; 3],
            Self::Cylinder { radius, half_length } => [radius, half_length, half_length],
        }
    }

    /// Returns the height of its center above the table on which it stands, in meters.
    #[cfg(feature = "mujoco")]
    pub(crate) const fn half_height(self) -> f64 {
        let [.., last] = self.sizes();
        last
    }

    /// Returns the name of the form in MJCF, and how many sizes it has there.
    pub(crate) const fn mjcf_type(self) -> (&'static str, usize) {
        match self {
            Self::Box { .. } => ("box", 3),
            Self::Sphere { .. } => ("sphere", 1),
            Self::Cylinder { .. } => ("cylinder", 2),
        }
    }
}
