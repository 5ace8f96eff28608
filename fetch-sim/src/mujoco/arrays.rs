use nalgebra::{Quaternion, Vector3};

/// The shim's numbering of the data's arrays.
#[derive(Clone, Copy)]
pub(super) enum DataArray {
    Qpos,
    Qvel,
    Ctrl,
    MocapPos,
    MocapQuat,
    QaccWarmstart,
    Xpos,
    Xquat,
    SiteXpos,
    SiteXmat,
}

pub(super) fn vector(values: &[f64], index: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&values[3 * index..][..3])
}

pub(super) fn set_vector(values: &mut [f64], index: usize, value: Vector3<f64>) {
    values[3 * index..][..3].copy_from_slice(value.as_slice());
}

pub(super) fn quaternion(values: &[f64], index: usize) -> Quaternion<f64> {
    let wxyz = &values[4 * index..][..4];
    Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3])
}

pub(super) fn set_quaternion(values: &mut [f64], index: usize, value: Quaternion<f64>) {
    values[4 * index..][..4].copy_from_slice(&[value.w, value.i, value.j, value.k]);
}
