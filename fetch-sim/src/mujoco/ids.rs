macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub struct $name(pub(super) usize);
    };
}

id!(
    /// A body of one model.
    BodyId
);
id!(
    /// A joint of one model.
    JointId
);
id!(
    /// A collision or display shape of one model.
    GeomId
);
id!(
    /// A site (a named frame on a body) of one model.
    SiteId
);

/// Indexes the shim's `fs_object_types`.
#[derive(Clone, Copy)]
pub(super) enum ObjectKind {
    Body,
    Joint,
    Geom,
    Site,
}

impl ObjectKind {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Body => "body",
            Self::Joint => "joint",
            Self::Geom => "geom",
            Self::Site => "site",
        }
    }
}
