//! The Rust side of the contract in `shim/fetch_shim.h`, which documents every item: the numbers
//! and structs that it shares with the shim, and the shim's functions.

#[cfg(fetch_sim_no_shim)]
mod nothing;

use std::ffi::{c_char, c_int, c_longlong};

#[cfg(fetch_sim_no_shim)]
use self::nothing::Nothing;

/// An item of the contract: the name of a number (with its value and size), of a struct (with 0 and
/// its size) or of a field of one (with its offset and size).
pub(crate) type Item = (&'static str, i64, usize);

/// Declares the items that Rust shares with the shim, and lists them in [`ITEMS`].
macro_rules! contract {
    (
        numbers { $($number:ident = $value:literal,)* }
        enums {
            $($(#[$enum_doc:meta])* $enum:ident { $($variant:ident = $c_number:ident,)* })*
        }
        structs {
            $(
                $(#[$attribute:meta])*
                $visibility:vis $struct:ident = $c_struct:ident {
                    $($(#[$field_doc:meta])* $field:ident: $type:ty,)*
                }
            )*
        }
    ) => {
        $(pub(crate) const $number: c_int = $value;)*
        $($(#[$enum_doc])* #[derive(Clone, Copy)] pub(crate) enum $enum { $($variant),* })*
        $(
            $(#[$attribute])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Default)]
            $visibility struct $struct { $($(#[$field_doc])* $visibility $field: $type),* }
        )*

        /// Everything that Rust shares with the shim.
        pub(crate) const ITEMS: &[Item] = &[
            $((stringify!($number), $number as i64, size_of::<c_int>()),)*
            $($((stringify!($c_number), $enum::$variant as i64, size_of::<c_int>()),)*)*
            $(
                (stringify!($c_struct), 0, size_of::<$struct>()),
                $((
                    concat!(stringify!($c_struct), ".", stringify!($field)),
                    std::mem::offset_of!($struct, $field) as i64,
                    size_of::<$type>(),
                ),)*
            )*
        ];
    };
}

contract! {
    numbers {
        FS_OK = 0, FS_FAILED = 1, FS_WARNED = 2,

        FS_NUM_DATA_ARRAYS = 12, FS_NUM_PHYSICS_ARRAYS = 18,

        FS_PLANE = 0, FS_SPHERE = 1, FS_CAPSULE = 2, FS_ELLIPSOID = 3, FS_CYLINDER = 4, FS_BOX = 5,
        FS_MESH = 6, FS_OTHER_SHAPE = 7,

        FS_BACKGROUND = 0, FS_SEGMENT_GEOM = 1, FS_SEGMENT_SITE = 2, FS_SEGMENT_OTHER = 3,
    }
    enums {
        /// Kinds of named objects.
        ObjectKind {
            Body = FS_BODY, Joint = FS_JOINT, Geom = FS_GEOM, Site = FS_SITE, Camera = FS_CAMERA,
        }

        /// Integer arrays of a model.
        ModelArray {
            JntQposadr = FS_JNT_QPOSADR, JntDofadr = FS_JNT_DOFADR, BodyMocapid = FS_BODY_MOCAPID,
            BodyParentid = FS_BODY_PARENTID, BodyJntadr = FS_BODY_JNTADR,
            GeomBodyid = FS_GEOM_BODYID, SiteBodyid = FS_SITE_BODYID, BodyBvhadr = FS_BODY_BVHADR,
            EqObj1id = FS_EQ_OBJ1ID, EqObj2id = FS_EQ_OBJ2ID, PairGeom1 = FS_PAIR_GEOM1,
            PairGeom2 = FS_PAIR_GEOM2,
        }

        /// Arrays of a model that a copy of it may change.
        PhysicsArray {
            GeomSize = FS_GEOM_SIZE, GeomRbound = FS_GEOM_RBOUND, GeomAabb = FS_GEOM_AABB,
            BvhAabb = FS_BVH_AABB, GeomFriction = FS_GEOM_FRICTION,
            PairFriction = FS_PAIR_FRICTION, BodyMass = FS_BODY_MASS,
            BodyInertia = FS_BODY_INERTIA, BodySubtreemass = FS_BODY_SUBTREEMASS,
            BodyInvweight = FS_BODY_INVWEIGHT, DofInvweight = FS_DOF_INVWEIGHT,
            DofDamping = FS_DOF_DAMPING, DofM0 = FS_DOF_M0, EqSolref = FS_EQ_SOLREF,
            ActuatorGainprm = FS_ACTUATOR_GAINPRM, ActuatorBiasprm = FS_ACTUATOR_BIASPRM,
            Gravity = FS_GRAVITY, Meaninertia = FS_MEANINERTIA,
        }

        /// Arrays of a simulation's data.
        DataArray {
            Qpos = FS_QPOS, Qvel = FS_QVEL, Ctrl = FS_CTRL, MocapPos = FS_MOCAP_POS,
            MocapQuat = FS_MOCAP_QUAT, QaccWarmstart = FS_QACC_WARMSTART, Xpos = FS_XPOS,
            Xquat = FS_XQUAT, Xmat = FS_XMAT, SiteXpos = FS_SITE_XPOS, SiteXmat = FS_SITE_XMAT,
            Act = FS_ACT,
        }

        /// Warnings that make a simulation useless.
        Fault {
            BadInertia = FS_BAD_INERTIA, ContactsFull = FS_CONTACTS_FULL,
            ConstraintsFull = FS_CONSTRAINTS_FULL, BadQpos = FS_BAD_QPOS, BadQvel = FS_BAD_QVEL,
            BadQacc = FS_BAD_QACC, BadCtrl = FS_BAD_CTRL,
        }
    }
    structs {
        /// Sizes of a model.
        pub(crate) Sizes = fs_sizes {
            nq: c_int, nv: c_int, nu: c_int, nbody: c_int, njnt: c_int, ngeom: c_int, nsite: c_int,
            ncam: c_int, nmocap: c_int, timestep: f64,
        }

        /// A geom as a viewer shows it.
        pub(crate) RawVisualGeom = fs_visual_geom {
            shape: c_int, group: c_int, body: c_int, ntriangle: c_int, rgba: [f32; 4],
            size: [f64; 3], position: [f64; 3], orientation: [f64; 4],
        }

        /// The work of a [`ContactFilter`](crate::ContactFilter) so far.
        #[derive(PartialEq, Eq)]
        #[non_exhaustive]
        pub ContactFilterCounts = fs_filter_counts {
            /// Pairs of geoms that MuJoCo was about to test.
            pairs: u64,
            /// Pairs that the filter rejected.
            rejected: u64,
            /// Rejections that were checked.
            checked: u64,
            /// Rejections that MuJoCo contradicted: always 0, unless the filter is wrong.
            refuted: u64,
        }

        /// An array of a simulation's data.
        pub(crate) RawArray = fs_array { first: *mut f64, len: usize, }

        /// Positions at which a picture shows copies of a site.
        pub(crate) RawGoals = fs_goals {
            site: c_int, count: c_int, color: [f32; 3], positions: *const f64,
        }

        /// How a picture shows an object.
        pub(crate) RawLook = fs_look { kind: c_int, id: c_int, color: [f32; 3], scale: f32, }

        /// What a picture shows otherwise than the model.
        pub(crate) RawLooks = fs_looks {
            objects: *const RawLook, count: c_int, light: [f64; 3], moved: [f64; 3],
            turned: [f64; 2], field: f64,
        }

        /// The object that a pixel shows.
        pub(crate) RawSegment = fs_segment { kind: c_int, id: c_int, }
    }
}

/// All arrays of a simulation's data, by [`DataArray`].
pub(crate) type DataArrays = [RawArray; FS_NUM_DATA_ARRAYS as usize];

/// All arrays of a model that a copy of it may change, by [`PhysicsArray`].
pub(crate) type PhysicsArrays = [RawArray; FS_NUM_PHYSICS_ARRAYS as usize];

/// A type of C that Rust knows only by pointer.
pub(crate) trait Opaque {
    /// The shim's function that deletes an object of this type.
    const DELETE: unsafe extern "C" fn(*mut Self);
}

/// Declares opaque types.
macro_rules! opaque {
    ($($(#[$attribute:meta])* $name:ident = $c_name:literal, $delete:ident;)*) => {$(
        #[doc = concat!("`", $c_name, "`")]
        $(#[$attribute])*
        #[derive(Debug)]
        #[repr(C)]
        pub(crate) struct $name {
            _opaque: [u8; 0],
        }

        $(#[$attribute])*
        impl Opaque for $name {
            const DELETE: unsafe extern "C" fn(*mut Self) = $delete;
        }
    )*};
}

opaque! {
    RawModel = "mjModel", fs_delete_model;
    RawData = "mjData", fs_delete_data;
    RawShapes = "fs_shapes", fs_delete_shapes;
    RawFilter = "fs_filter", fs_delete_filter;
    #[cfg(feature = "render")]
    RawRenderer = "fs_renderer", fs_delete_renderer;
}

/// Whether this build has no shim, because it found no headers of MuJoCo.
pub(crate) const IS_MISSING: bool = cfg!(fetch_sim_no_shim);

/// Declares the functions of the shim. A build without it has functions with the same signatures
/// that do nothing; loading MuJoCo fails before any of them is called, and none of them makes an
/// object.
macro_rules! functions {
    (
        safe { $($(#[$safe_attribute:meta])* fn $safe:ident() -> $safe_result:ty;)* }
        unsafe {
            $(
                $(#[$attribute:meta])*
                fn $name:ident($($argument:ident: $type:ty),* $(,)?) $(-> $result:ty)?;
            )*
        }
    ) => {
        #[cfg(not(fetch_sim_no_shim))]
        unsafe extern "C" {
            $($(#[$safe_attribute])* pub(crate) safe fn $safe() -> $safe_result;)*
            $($(#[$attribute])* pub(crate) fn $name($($argument: $type),*) $(-> $result)?;)*
        }
        $(
            #[cfg(fetch_sim_no_shim)]
            $(#[$safe_attribute])*
            pub(crate) extern "C" fn $safe() -> $safe_result {
                Nothing::NOTHING
            }
        )*
        $(
            #[cfg(fetch_sim_no_shim)]
            $(#[$attribute])*
            pub(crate) unsafe extern "C" fn $name($(_: $type),*) $(-> $result)? {
                Nothing::NOTHING
            }
        )*
    };
}

functions! {
    safe {
        fn fs_header_version() -> c_int;
        fn fs_error_text() -> *const c_char;
        fn fs_warning_text() -> *const c_char;
        fn fs_global_library_path() -> *const c_char;
        #[cfg(feature = "render")]
        fn fs_gl_backend() -> *const c_char;
    }
    unsafe {
        fn fs_contract(
            index: c_int,
            name: *mut *const c_char,
            value: *mut c_longlong,
            size: *mut usize,
        ) -> c_int;
        fn fs_load(path: *const c_char, version: *mut c_int) -> c_int;
        fn fs_library_path() -> *const c_char;
        fn fs_others_library_path(name: *const c_char) -> *const c_char;
        fn fs_load_plugin(path: *const c_char, library_name: *const c_char) -> c_int;

        fn fs_load_path(path: *const c_char, m: *mut *mut RawModel) -> c_int;
        fn fs_load_files(
            names: *const *const c_char,
            bytes: *const *const u8,
            sizes: *const c_int,
            count: c_int,
            m: *mut *mut RawModel,
        ) -> c_int;
        fn fs_copy_model(m: *const RawModel, copy: *mut *mut RawModel) -> c_int;
        fn fs_delete_model(m: *mut RawModel);
        fn fs_model_sizes(m: *const RawModel, sizes: *mut Sizes);
        fn fs_name_to_id(
            m: *const RawModel,
            kind: c_int,
            name: *const c_char,
            id: *mut c_int,
        ) -> c_int;
        fn fs_id_to_name(
            m: *const RawModel,
            kind: c_int,
            id: c_int,
            name: *mut *const c_char,
        ) -> c_int;
        fn fs_actuator_joint(m: *const RawModel, actuator: c_int) -> c_int;
        fn fs_model_array(m: *const RawModel, array: c_int, len: *mut c_int) -> *const c_int;
        fn fs_physics_arrays(m: *mut RawModel, out: *mut PhysicsArrays);
        fn fs_set_weld_data(m: *mut RawModel, body: c_int, values: *const f64, count: c_int);
        fn fs_limit_sizes(m: *mut RawModel, njmax: c_int, nstack: c_int);
        fn fs_disable_midphase(m: *mut RawModel);
        fn fs_geom_shape(m: *const RawModel, geom: c_int) -> c_int;
        fn fs_get_visual_geom(m: *const RawModel, geom: c_int, out: *mut RawVisualGeom);
        fn fs_get_triangle(m: *const RawModel, geom: c_int, at: c_int, out: *mut [f64; 3]);

        fn fs_make_data(m: *const RawModel, d: *mut *mut RawData) -> c_int;
        fn fs_delete_data(d: *mut RawData);
        fn fs_reset(m: *const RawModel, d: *mut RawData) -> c_int;
        fn fs_forward(m: *const RawModel, d: *mut RawData, f: *mut RawFilter) -> c_int;
        fn fs_step(
            m: *const RawModel,
            d: *mut RawData,
            f: *mut RawFilter,
            n: c_int,
        ) -> c_int;
        fn fs_site_jacobian(
            m: *const RawModel,
            d: *const RawData,
            site: c_int,
            translation: *mut f64,
            rotation: *mut f64,
        ) -> c_int;
        fn fs_body_jacobian(
            m: *const RawModel,
            d: *const RawData,
            body: c_int,
            translation: *mut f64,
            rotation: *mut f64,
        ) -> c_int;
        fn fs_time(d: *const RawData) -> f64;
        fn fs_set_time(d: *mut RawData, time: f64);
        fn fs_data_arrays(m: *const RawModel, d: *const RawData, out: *mut DataArrays);
        fn fs_contact_count(d: *const RawData) -> c_int;
        fn fs_contact_geoms(d: *const RawData, contact: c_int, geoms: *mut [c_int; 2]);
        fn fs_fault_count(d: *const RawData, fault: c_int) -> c_int;

        fn fs_make_shapes(m: *const RawModel) -> *mut RawShapes;
        fn fs_copy_shapes(shapes: *const RawShapes) -> *mut RawShapes;
        fn fs_resize_shape(shapes: *mut RawShapes, m: *const RawModel, geom: c_int);
        fn fs_delete_shapes(shapes: *mut RawShapes);
        fn fs_make_filter(shapes: *const RawShapes, d: *const RawData) -> *mut RawFilter;
        fn fs_delete_filter(f: *mut RawFilter);
        fn fs_set_filter_shapes(f: *mut RawFilter, shapes: *const RawShapes);
        fn fs_check_filter(f: *mut RawFilter, check: c_int);
        fn fs_get_filter_counts(f: *const RawFilter, counts: *mut ContactFilterCounts);

        #[cfg(feature = "render")]
        fn fs_prepare_model(m: *mut RawModel, width: c_int, height: c_int, samples: c_int);
        #[cfg(feature = "render")]
        fn fs_place(m: *const RawModel, d: *mut RawData) -> c_int;
        #[cfg(feature = "render")]
        fn fs_make_renderer(
            m: *const RawModel,
            r: *mut *mut RawRenderer,
            has_gl: *mut c_int,
        ) -> c_int;
        #[cfg(feature = "render")]
        fn fs_delete_renderer(r: *mut RawRenderer);
        #[cfg(feature = "render")]
        fn fs_set_free_camera(r: *mut RawRenderer, numbers: *const [f64; 6]);
        #[cfg(feature = "render")]
        fn fs_set_fixed_camera(r: *mut RawRenderer, id: c_int);
        #[cfg(feature = "render")]
        fn fs_draw(
            r: *mut RawRenderer,
            m: *const RawModel,
            d: *const RawData,
            goals: *const RawGoals,
            looks: *const RawLooks,
            segments: c_int,
            rgb: *mut u8,
            depth: *mut f32,
        ) -> c_int;
        #[cfg(feature = "render")]
        fn fs_planes(r: *const RawRenderer, planes: *mut [f32; 2]) -> c_int;
        #[cfg(feature = "render")]
        fn fs_segments(r: *const RawRenderer, out: *mut RawSegment, size: c_int) -> c_int;
    }
}
