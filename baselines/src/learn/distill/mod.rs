//! Distilling: a student imitates a teacher on the states to which the student's own actions lead.

mod checkpoint;
pub(super) mod distiller;
pub(super) mod frames;
#[cfg(feature = "render")]
pub(super) mod pixels;
pub(super) mod rounds;
pub(super) mod settings;
pub(super) mod student;
pub(super) mod teacher;
