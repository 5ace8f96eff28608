//! The results of a missing shim: nothing.

use std::{ffi::c_int, ptr};

/// The value that a function of a missing shim returns.
pub(crate) trait Nothing {
    const NOTHING: Self;
}

impl Nothing for () {
    const NOTHING: Self = ();
}

impl Nothing for c_int {
    const NOTHING: Self = 0;
}

impl Nothing for f64 {
    const NOTHING: Self = 0.0;
}

impl<T> Nothing for *const T {
    const NOTHING: Self = ptr::null();
}

impl<T> Nothing for *mut T {
    const NOTHING: Self = ptr::null_mut();
}
