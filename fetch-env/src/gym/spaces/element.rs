//! The elements of arrays.

use std::fmt::Debug;

use super::{Space, Value};

/// An element of arrays: a number of single or double precision, a byte of an image, the number of
/// a choice, or a boolean.
///
/// ```
/// use fetch_env::spaces::{ArrayElement, DiscreteSpace, Value};
///
/// assert_eq!(i64::value(&[3]), Value::I64(vec![3]));
/// assert_eq!(i64::len_in(&DiscreteSpace::new(4)?.into()), Some(1));
/// # Ok::<(), fetch_env::spaces::SpaceError>(())
/// ```
pub trait ArrayElement: Copy + Debug + PartialEq + Send + Sync + private::Sealed + 'static {
    /// The element of an array that has not been written yet: NaN, 0 or false.
    const EMPTY: Self;

    /// Returns the number of elements of a member of `space`; `None` if its elements are of another
    /// type.
    fn len_in(space: &Space) -> Option<usize>;

    /// Returns an array as a value of a space.
    fn value(array: &[Self]) -> Value;

    /// Returns the element as a number: 1 for true, 0 for false.
    fn to_f64(self) -> f64;
}

mod private {
    pub trait Sealed {}
}

macro_rules! array_element {
    ($($type:ident: $empty:expr, $value:ident, $($space:ident)|+, $to_f64:expr;)*) => {$(
        impl private::Sealed for $type {}

        impl ArrayElement for $type {
            const EMPTY: Self = $empty;

            fn len_in(space: &Space) -> Option<usize> {
                match space {
                    $(Space::$space(space) => Some(space.len()),)+
                    _ => None,
                }
            }

            fn value(array: &[Self]) -> Value {
                Value::$value(array.into())
            }

            fn to_f64(self) -> f64 {
                $to_f64(self)
            }
        }
    )*};
}

array_element! {
    f32: Self::NAN, F32, BoxF32, f64::from;
    f64: Self::NAN, F64, BoxF64, f64::from;
    u8: 0, U8, Image, f64::from;
    i64: 0, I64, Discrete | MultiDiscrete, |choice| choice as f64;
    bool: false, Bool, MultiBinary, f64::from;
}
