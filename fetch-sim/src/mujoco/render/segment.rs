use std::ffi::c_int;

use super::super::ids::{GeomId, SiteId};

/// What a pixel shows.
///
/// The ids are those of the renderer's [`model`](super::Renderer::model), which has shapes that the
/// simulation does without.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Segment {
    /// Nothing of the model: the sky.
    #[default]
    Background,
    /// A geom.
    Geom(GeomId),
    /// A site, such as the goal's red sphere.
    Site(SiteId),
    /// Something else that MuJoCo draws.
    Other,
}

/// The shim's numbering of kinds, and the id.
pub(super) type RawSegment = [c_int; 2];

impl From<RawSegment> for Segment {
    fn from([kind, id]: RawSegment) -> Self {
        match (kind, usize::try_from(id)) {
            (0, _) => Self::Background,
            (1, Ok(id)) => Self::Geom(GeomId(id)),
            (2, Ok(id)) => Self::Site(SiteId(id)),
            _ => Self::Other,
        }
    }
}
