//! The objects that the pixels of a picture show.

use super::super::binding::{
    ffi::{self, RawSegment},
    ids::{GeomId, SiteId},
};

/// The object that a pixel shows.
///
/// The ids belong to the renderer's [`model`](super::Renderer::model), which has shapes that the
/// simulation lacks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Segment {
    /// No part of the model: the sky.
    #[default]
    Background,
    /// A geom.
    Geom(GeomId),
    /// A site, such as the goal's red sphere.
    Site(SiteId),
    /// Something else that MuJoCo draws.
    Other,
}

impl From<RawSegment> for Segment {
    fn from(RawSegment { kind, id }: RawSegment) -> Self {
        match (kind, usize::try_from(id)) {
            (ffi::FS_BACKGROUND, _) => Self::Background,
            (ffi::FS_SEGMENT_GEOM, Ok(id)) => Self::Geom(GeomId(id)),
            (ffi::FS_SEGMENT_SITE, Ok(id)) => Self::Site(SiteId(id)),
            _ => Self::Other,
        }
    }
}
