//! The Rust side of the contract in `shim/fetch_shim.h`, which documents every item: the numbers and
//! structs that it shares with the shim, and the shim's functions.

use std::ffi::{c_char, c_int, c_ulonglong};

/// An item of the contract: a number (its value and size), a struct (0 and its size) or a field of
/// one (its offset and size).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Item {
    pub(super) name: &'static str,
    pub(super) value: i64,
    pub(super) size: usize,
}

/// Declares what Rust shares with the shim, and lists it in [`ITEMS`].
macro_rules! contract {
    (
        numbers { $($number:ident = $value:literal;)* }
        enums {
            $($(#[$enum_doc:meta])* $enum:ident { $($variant:ident = $c_number:ident,)* })*
        }
        structs {
            $($(#[$doc:meta])* $struct:ident = $c_struct:ident { $($field:ident: $type:ty,)* })*
        }
    ) => {
        $(pub(super) const $number: c_int = $value;)*
        $($(#[$enum_doc])* #[derive(Clone, Copy)] pub(super) enum $enum { $($variant),* })*
        $(
            $(#[$doc])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Default)]
            pub(super) struct $struct { $(pub(super) $field: $type),* }
        )*

        /// Everything that Rust shares with the shim.
        pub(super) const ITEMS: &[Item] = &[
            $(Item {
                name: stringify!($number),
                value: $number as i64,
                size: size_of::<c_int>(),
            },)*
            $($(Item {
                name: stringify!($c_number),
                value: $enum::$variant as i64,
                size: size_of::<c_int>(),
            },)*)*
            $(
                Item { name: stringify!($c_struct), value: 0, size: size_of::<$struct>() },
                $(Item {
                    name: concat!(stringify!($c_struct), ".", stringify!($field)),
                    value: std::mem::offset_of!($struct, $field) as i64,
                    size: size_of::<$type>(),
                },)*
            )*
        ];
    };
}

contract! {
    numbers {
        FS_OK = 0;
        FS_FAILED = 1;
        FS_WARNED = 2;

        FS_PLANE = 0;
        FS_SPHERE = 1;
        FS_CAPSULE = 2;
        FS_ELLIPSOID = 3;
        FS_CYLINDER = 4;
        FS_BOX = 5;
        FS_MESH = 6;
        FS_OTHER_SHAPE = 7;

        FS_BACKGROUND = 0;
        FS_SEGMENT_GEOM = 1;
        FS_SEGMENT_SITE = 2;
        FS_SEGMENT_OTHER = 3;
    }
    enums {
        /// Kinds of named objects.
        ObjectKind {
            Body = FS_BODY,
            Joint = FS_JOINT,
            Geom = FS_GEOM,
            Site = FS_SITE,
            Camera = FS_CAMERA,
        }

        /// Integer arrays of a model.
        ModelArray {
            JntQposadr = FS_JNT_QPOSADR,
            JntDofadr = FS_JNT_DOFADR,
            BodyMocapid = FS_BODY_MOCAPID,
            BodyParentid = FS_BODY_PARENTID,
            GeomBodyid = FS_GEOM_BODYID,
            ActuatorTrnid = FS_ACTUATOR_TRNID,
        }

        /// Arrays of a simulation's data.
        DataArray {
            Qpos = FS_QPOS,
            Qvel = FS_QVEL,
            Ctrl = FS_CTRL,
            MocapPos = FS_MOCAP_POS,
            MocapQuat = FS_MOCAP_QUAT,
            QaccWarmstart = FS_QACC_WARMSTART,
            Xpos = FS_XPOS,
            Xquat = FS_XQUAT,
            SiteXpos = FS_SITE_XPOS,
            SiteXmat = FS_SITE_XMAT,
        }

        /// Warnings that make a simulation useless.
        Fault {
            BadInertia = FS_BAD_INERTIA,
            ContactsFull = FS_CONTACTS_FULL,
            ConstraintsFull = FS_CONSTRAINTS_FULL,
            BadQpos = FS_BAD_QPOS,
            BadQvel = FS_BAD_QVEL,
            BadQacc = FS_BAD_QACC,
            BadCtrl = FS_BAD_CTRL,
        }
    }
    structs {
        /// Sizes of a model.
        Sizes = fs_sizes {
            nq: c_int,
            nv: c_int,
            nu: c_int,
            nbody: c_int,
            njnt: c_int,
            ngeom: c_int,
            nsite: c_int,
            ncam: c_int,
            nmocap: c_int,
            timestep: f64,
        }

        /// A geom as a viewer shows it.
        RawVisualGeom = fs_visual_geom {
            shape: c_int,
            group: c_int,
            body: c_int,
            ntriangle: c_int,
            rgba: [f32; 4],
            size: [f64; 3],
            position: [f64; 3],
            orientation: [f64; 4],
        }

        /// Pairs of geoms that a contact filter has seen.
        FilterCounts = fs_filter_counts {
            pairs: c_ulonglong,
            rejected: c_ulonglong,
            checked: c_ulonglong,
            refuted: c_ulonglong,
        }

        /// What a pixel shows.
        RawSegment = fs_segment {
            kind: c_int,
            id: c_int,
        }
    }
}

/// Declares types of C that Rust knows only by pointer.
macro_rules! opaque {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        #[repr(C)]
        pub(super) struct $name {
            _opaque: [u8; 0],
        }
    )*};
}

opaque! {
    /// `mjModel`
    RawModel
    /// `mjData`
    RawData
    /// `fs_shapes`
    RawShapes
    /// `fs_filter`
    RawFilter
    /// `fs_renderer`
    #[cfg(feature = "render")]
    RawRenderer
}

unsafe extern "C" {
    pub(super) fn fs_contract(
        index: c_int,
        name: *mut *const c_char,
        value: *mut i64,
        size: *mut usize,
    ) -> c_int;
    pub(super) safe fn fs_header_version() -> c_int;
    pub(super) fn fs_load(
        path: *const c_char,
        plugins: *const c_char,
        version: *mut c_int,
    ) -> c_int;
    pub(super) safe fn fs_error_text() -> *const c_char;
    pub(super) safe fn fs_warning_text() -> *const c_char;

    pub(super) fn fs_load_path(path: *const c_char, model: *mut *mut RawModel) -> c_int;
    pub(super) fn fs_load_files(
        names: *const *const c_char,
        bytes: *const *const u8,
        sizes: *const c_int,
        count: c_int,
        model: *mut *mut RawModel,
    ) -> c_int;
    pub(super) fn fs_delete_model(model: *mut RawModel);
    pub(super) fn fs_model_sizes(model: *const RawModel, sizes: *mut Sizes);
    pub(super) fn fs_name_to_id(model: *const RawModel, kind: c_int, name: *const c_char) -> c_int;
    pub(super) fn fs_id_to_name(model: *const RawModel, kind: c_int, id: c_int) -> *const c_char;
    pub(super) fn fs_model_array(model: *const RawModel, array: c_int) -> *const c_int;
    pub(super) fn fs_set_weld_data(model: *mut RawModel, values: *const f64, count: c_int);
    pub(super) fn fs_limit_sizes(model: *mut RawModel, njmax: c_int, nstack: c_int);
    pub(super) fn fs_disable_midphase(model: *mut RawModel);
    pub(super) fn fs_get_visual_geom(model: *const RawModel, geom: c_int, out: *mut RawVisualGeom);
    pub(super) fn fs_get_triangle(
        model: *const RawModel,
        geom: c_int,
        triangle: c_int,
        corners: *mut [f64; 3],
    );

    pub(super) fn fs_make_data(model: *const RawModel, data: *mut *mut RawData) -> c_int;
    pub(super) fn fs_delete_data(data: *mut RawData);
    pub(super) fn fs_reset(model: *const RawModel, data: *mut RawData) -> c_int;
    pub(super) fn fs_forward(
        model: *const RawModel,
        data: *mut RawData,
        filter: *mut RawFilter,
    ) -> c_int;
    pub(super) fn fs_step(
        model: *const RawModel,
        data: *mut RawData,
        filter: *mut RawFilter,
        count: c_int,
    ) -> c_int;
    pub(super) fn fs_site_jacobian(
        model: *const RawModel,
        data: *const RawData,
        site: c_int,
        translation: *mut f64,
        rotation: *mut f64,
    );
    pub(super) fn fs_time(data: *const RawData) -> f64;
    pub(super) fn fs_set_time(data: *mut RawData, time: f64);
    pub(super) fn fs_data_array(data: *const RawData, array: c_int) -> *mut f64;
    pub(super) fn fs_constraint_count(data: *const RawData) -> c_int;
    pub(super) fn fs_contact_count(data: *const RawData) -> c_int;
    pub(super) fn fs_contact_geoms(
        data: *const RawData,
        contact: c_int,
        geom1: *mut c_int,
        geom2: *mut c_int,
    );
    pub(super) fn fs_fault_count(data: *const RawData, fault: c_int) -> c_int;

    pub(super) fn fs_make_shapes(model: *const RawModel) -> *mut RawShapes;
    pub(super) fn fs_delete_shapes(shapes: *mut RawShapes);
    pub(super) fn fs_make_filter(shapes: *const RawShapes, data: *const RawData) -> *mut RawFilter;
    pub(super) fn fs_delete_filter(filter: *mut RawFilter);
    pub(super) fn fs_check_filter(filter: *mut RawFilter, check: c_int);
    pub(super) fn fs_get_filter_counts(filter: *const RawFilter, counts: *mut FilterCounts);
}

#[cfg(feature = "render")]
unsafe extern "C" {
    pub(super) safe fn fs_gl_backend() -> *const c_char;
    pub(super) fn fs_prepare_model(
        model: *mut RawModel,
        width: c_int,
        height: c_int,
        samples: c_int,
    );
    pub(super) fn fs_place(model: *const RawModel, data: *mut RawData) -> c_int;
    pub(super) fn fs_make_renderer(
        model: *const RawModel,
        renderer: *mut *mut RawRenderer,
        has_gl: *mut c_int,
    ) -> c_int;
    pub(super) fn fs_delete_renderer(renderer: *mut RawRenderer);
    pub(super) fn fs_set_free_camera(
        renderer: *mut RawRenderer,
        lookat: *const f64,
        distance: f64,
        azimuth: f64,
        elevation: f64,
    );
    pub(super) fn fs_set_fixed_camera(renderer: *mut RawRenderer, id: c_int);
    pub(super) fn fs_draw(
        renderer: *mut RawRenderer,
        model: *const RawModel,
        data: *const RawData,
        segments: c_int,
        rgb: *mut u8,
        depth: *mut f32,
    ) -> c_int;
    pub(super) fn fs_planes(
        renderer: *const RawRenderer,
        near: *mut f32,
        far: *mut f32,
        parallel: *mut c_int,
    );
    pub(super) fn fs_segments(
        renderer: *const RawRenderer,
        segments: *mut RawSegment,
        size: c_int,
    ) -> c_int;
}
