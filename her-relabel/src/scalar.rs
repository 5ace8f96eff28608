//! The two element types a buffer can store.

use std::fmt;

/// An element type of the buffer: `f32` or `f64`. Sealed.
///
/// Rewards are computed in `f64`; `f32` elements are widened for that, which is exact.
pub trait Scalar:
    sealed::Sealed + Copy + Default + PartialEq + fmt::Debug + Send + Sync + 'static
{
    /// The same number as `f64`.
    fn to_f64(self) -> f64;

    /// The nearest number of this type.
    fn from_f64(value: f64) -> Self;

    /// The number's bits, in the lowest places.
    fn bits(self) -> u64;

    /// The number with these bits; higher places are ignored.
    fn from_bits(bits: u64) -> Self;
}

impl Scalar for f32 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value as Self
    }

    #[inline(always)]
    fn bits(self) -> u64 {
        u64::from(self.to_bits())
    }

    #[inline(always)]
    fn from_bits(bits: u64) -> Self {
        Self::from_bits(bits as u32)
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn bits(self) -> u64 {
        self.to_bits()
    }

    #[inline(always)]
    fn from_bits(bits: u64) -> Self {
        Self::from_bits(bits)
    }
}

mod sealed {
    /// On Linux the elements lie in memory that comes as bytes.
    #[cfg(target_os = "linux")]
    pub trait Sealed: bytemuck::Pod {}
    #[cfg(not(target_os = "linux"))]
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}
