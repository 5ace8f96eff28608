//! The two element types a buffer can store.

use std::fmt;

/// An element type of the buffer: `f32` or `f64`. Sealed.
///
/// Rewards are computed in `f64`, to which `f32` elements are widened exactly.
///
/// # Example
/// ```
/// use her_relabel::Scalar;
///
/// fn mean<T: Scalar>(rewards: &[T]) -> f64 {
///     rewards.iter().map(|reward| reward.to_f64()).sum::<f64>() / rewards.len() as f64
/// }
/// assert_eq!(mean(&[-1.0_f32, 0.0]), -0.5);
/// ```
pub trait Scalar:
    sealed::Sealed + Copy + Default + PartialEq + fmt::Debug + Send + Sync + 'static
{
    /// Returns the number as `f64`.
    fn to_f64(self) -> f64;

    /// Returns the nearest number of this type.
    fn from_f64(value: f64) -> Self;

    /// Returns the number's bits, as the lowest bits of a word.
    fn bits(self) -> u64;

    /// Returns the number with these bits; higher bits are ignored.
    fn from_bits(bits: u64) -> Self;
}

macro_rules! scalars {
    ($($float:ty, $bits:ty;)*) => {$(
        impl sealed::Sealed for $float {}

        impl Scalar for $float {
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self.into()
            }

            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as Self
            }

            #[inline(always)]
            fn bits(self) -> u64 {
                self.to_bits().into()
            }

            #[inline(always)]
            fn from_bits(bits: u64) -> Self {
                Self::from_bits(bits as $bits)
            }
        }
    )*};
}

scalars! {
    f32, u32;
    f64, u64;
}

mod sealed {
    /// On Linux, the memory of the elements comes as bytes.
    #[cfg(target_os = "linux")]
    pub trait Sealed: bytemuck::Pod {}
    #[cfg(not(target_os = "linux"))]
    pub trait Sealed {}
}
