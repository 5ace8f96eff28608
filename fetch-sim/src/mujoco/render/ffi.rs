//! The functions of `shim/render_shim.c`, one to one. Their contracts are told there.

use std::ffi::{c_char, c_int};

use super::super::ffi::{RawData, RawModel};

/// The shim's `fs_renderer`, never looked into from Rust.
#[repr(C)]
pub(super) struct RawRenderer {
    _opaque: [u8; 0],
}

unsafe extern "C" {
    pub(super) fn fs_load_renderer() -> c_int;
    pub(super) safe fn fs_gl_backend() -> *const c_char;

    pub(super) fn fs_prepare_model(
        model: *mut RawModel,
        width: c_int,
        height: c_int,
        samples: c_int,
    );
    pub(super) fn fs_place(model: *const RawModel, data: *mut RawData) -> c_int;
    pub(super) fn fs_camera_count(model: *const RawModel) -> c_int;
    pub(super) fn fs_camera_id(model: *const RawModel, name: *const c_char) -> c_int;
    pub(super) fn fs_camera_name(model: *const RawModel, id: c_int) -> *const c_char;

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
        segments: *mut [c_int; 2],
        size: c_int,
    ) -> c_int;
}
