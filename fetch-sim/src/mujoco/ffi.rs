//! The functions of the shim, one to one (those of `shim/render_shim.c` are in `render/ffi.rs`). Their
//! contracts are told there.

use std::ffi::{c_char, c_int};

use super::contact_filter::ContactFilterCounts;

/// MuJoCo's `mjModel`, never looked into from Rust.
#[repr(C)]
pub(super) struct RawModel {
    _opaque: [u8; 0],
}

/// MuJoCo's `mjData`, never looked into from Rust.
#[repr(C)]
pub(super) struct RawData {
    _opaque: [u8; 0],
}

/// The shim's `fs_shapes`.
#[repr(C)]
pub(super) struct RawShapes {
    _opaque: [u8; 0],
}

/// The shim's `fs_filter`.
#[repr(C)]
pub(super) struct RawFilter {
    _opaque: [u8; 0],
}

pub(super) const FAILED: c_int = 1;
pub(super) const WARNED: c_int = 2;

/// The shim's `fs_sizes`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sizes {
    pub(super) nq: c_int,
    pub(super) nv: c_int,
    pub(super) nu: c_int,
    pub(super) nbody: c_int,
    pub(super) njnt: c_int,
    pub(super) ngeom: c_int,
    pub(super) nsite: c_int,
    pub(super) nmocap: c_int,
    pub(super) timestep: f64,
}

/// The shim's `fs_visual_geom`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RawVisualGeom {
    pub(super) shape: c_int,
    pub(super) group: c_int,
    pub(super) body: c_int,
    pub(super) triangle_count: c_int,
    pub(super) rgba: [f32; 4],
    pub(super) size: [f64; 3],
    pub(super) position: [f64; 3],
    pub(super) orientation: [f64; 4],
}

unsafe extern "C" {
    pub(super) safe fn fs_header_version() -> c_int;
    pub(super) fn fs_load(
        path: *const c_char,
        plugins: *const c_char,
        version: *mut c_int,
        reason: *mut c_char,
        reason_size: usize,
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
    pub(super) fn fs_model_field(model: *const RawModel, field: c_int) -> *const c_int;
    pub(super) fn fs_limit_sizes(model: *mut RawModel, njmax: c_int, nstack: c_int);
    pub(super) fn fs_disable_midphase(model: *mut RawModel);
    pub(super) fn fs_set_weld_data(model: *mut RawModel, values: *const f64, count: c_int);

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
    pub(super) fn fs_data_field(data: *const RawData, field: c_int) -> *mut f64;
    pub(super) fn fs_constraint_count(data: *const RawData) -> c_int;
    pub(super) fn fs_contact_count(data: *const RawData) -> c_int;
    pub(super) fn fs_contact_geoms(
        data: *const RawData,
        contact: c_int,
        geom1: *mut c_int,
        geom2: *mut c_int,
    );
    pub(super) fn fs_warning_count(data: *const RawData, kind: c_int) -> c_int;

    pub(super) fn fs_make_shapes(model: *const RawModel) -> *mut RawShapes;
    pub(super) fn fs_delete_shapes(shapes: *mut RawShapes);
    pub(super) fn fs_make_filter(shapes: *const RawShapes, data: *const RawData) -> *mut RawFilter;
    pub(super) fn fs_delete_filter(filter: *mut RawFilter);
    pub(super) fn fs_check_filter(filter: *mut RawFilter, check: c_int);
    pub(super) fn fs_get_filter_counts(filter: *const RawFilter, counts: *mut ContactFilterCounts);

    pub(super) fn fs_get_visual_geom(model: *const RawModel, geom: c_int, out: *mut RawVisualGeom);
    pub(super) fn fs_get_triangle(
        model: *const RawModel,
        geom: c_int,
        triangle: c_int,
        corners: *mut [f64; 3],
    );
}
