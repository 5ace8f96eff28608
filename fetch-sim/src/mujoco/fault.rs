use std::ffi::c_int;

use crate::SimError;

/// Indexes the shim's `fs_warning_types`.
const WARNINGS: [(&str, Fault); 7] = [
    ("the inertia matrix is singular", Fault::Unstable),
    ("the contact buffer is full", Fault::Full),
    ("the constraint buffer is full", Fault::Full),
    ("a position is not finite or huge", Fault::Unstable),
    ("a velocity is not finite or huge", Fault::Unstable),
    ("an acceleration is not finite or huge", Fault::Unstable),
    ("a control is not finite or huge", Fault::Unstable),
];

#[derive(Clone, Copy)]
enum Fault {
    Unstable,
    Full,
}

/// The first fault of a simulation, by how often MuJoCo counted each kind of warning.
pub(super) fn find_fault(count: impl Fn(c_int) -> c_int) -> Result<(), SimError> {
    match (0..).zip(&WARNINGS).find(|&(kind, _)| count(kind) > 0) {
        None => Ok(()),
        Some((_, &(reason, Fault::Unstable))) => Err(SimError::Unstable { reason: reason.into() }),
        Some((_, &(reason, Fault::Full))) => Err(SimError::BufferFull { reason: reason.into() }),
    }
}
