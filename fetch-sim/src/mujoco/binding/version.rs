//! Versions of MuJoCo.

use std::{ffi::c_int, fmt};

use super::ffi;

/// A version of MuJoCo, such as 2.2.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MujocoVersion(pub(super) c_int);

impl MujocoVersion {
    /// The first version that finds four contacts where the base's mesh stands on the floor.
    pub(crate) const FOUR_SUPPORTS: Self = Self(3_013_000);

    /// Returns the version of the headers against which this crate was built; `None` if it was
    /// built without MuJoCo.
    #[must_use]
    pub fn of_headers() -> Option<Self> {
        (!ffi::IS_MISSING).then(Self::of_shim)
    }

    /// Returns the version of a library that is loaded.
    pub(crate) fn of_shim() -> Self {
        Self(ffi::fs_header_version())
    }

    /// Returns major, minor and patch.
    pub(super) fn numbers(self) -> [u32; 3] {
        let version = self.0.unsigned_abs();
        // 2.2.2 counts as 222, 3.6.0 as 3006000.
        if version < 1_000_000 {
            [version / 100, version / 10 % 10, version % 10]
        } else {
            [version / 1_000_000, version / 1000 % 1000, version % 1000]
        }
    }
}

impl fmt::Display for MujocoVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [major, minor, patch] = self.numbers();
        write!(f, "{major}.{minor}.{patch}")
    }
}
