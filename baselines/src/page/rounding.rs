//! The precision of the numbers in a page.

/// Rounds to a hundredth of a millimeter, which is far less than a pixel.
pub(super) fn rounded(value: f64) -> f64 {
    (value * 1e5).round() / 1e5
}
