//! Distilling: a student imitates a teacher on the states to which the student's own actions lead.

mod checkpoint;
pub(super) mod distiller;
mod frames;
#[cfg(feature = "render")]
mod pixels;
mod rounds;
pub(super) mod settings;
mod student;
pub(super) mod teacher;
