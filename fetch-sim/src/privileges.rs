//! Whether the user who started this program may tell it what to load.

/// Returns whether this program has more privileges than the user who started it (set-user-ID,
/// set-group-ID or capabilities of its file): that user's variables and home must not guide it
/// then.
pub(crate) fn are_raised() -> bool {
    #[cfg(any(target_os = "linux", target_os = "android"))]
    {
        use std::ffi::c_ulong;

        const AT_SECURE: c_ulong = 23;
        // SAFETY: declared as in C; it takes any number, and only reads.
        unsafe extern "C" {
            safe fn getauxval(kind: c_ulong) -> c_ulong;
        }
        getauxval(AT_SECURE) != 0
    }
    #[cfg(target_vendor = "apple")]
    {
        use std::ffi::c_int;

        // SAFETY: declared as in C; it only reads.
        unsafe extern "C" {
            safe fn issetugid() -> c_int;
        }
        issetugid() != 0
    }
    #[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
    false
}
