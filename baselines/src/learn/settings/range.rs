//! Ranges of settings.

/// Checks that a number, if there is one, or each number of a list is in its range.
macro_rules! check_range {
    (
        $number:expr,
        $name:expr,
        $least:literal..=$most:literal $(in at most $layers:literal layers)?
    ) => {
        if $crate::learn::settings::range::Bounded::is_within(&$number, $least..=$most)
            $(&& $number.len() <= $layers)?
        {
            Ok(())
        } else {
            Err($crate::learn::TrainError::Setting {
                name: $name,
                value: format!("{:?}", $number),
                expected: concat!(
                    "choose from ", stringify!($least), " to ", stringify!($most)
                    $(, " in at most ", stringify!($layers), " layers")?
                ),
            })
        }
    };
}

/// Defines settings. A field's type is followed by its default and, for a number, by its range. Both
/// are documented from here, and a number out of its range is an error that names both.
macro_rules! ranged_settings {
    (
        $(#[$of_all:meta])*
        pub struct $settings:ident {$(
            $(#[$of_field:meta])*
            pub $field:ident: $type:ty = $default:expr
                $(=> $least:literal..=$most:literal $(in at most $layers:literal layers)?)?,
        )*}
    ) => {
        $(#[$of_all])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        // A file of a version without a setting has its default, which changes nothing.
        #[serde(default, deny_unknown_fields)]
        pub struct $settings {$(
            $(#[$of_field])*
            ///
            $(
                #[doc = concat!(
                    "Range: ", stringify!($least), " to ", stringify!($most)
                    $(, ", in at most ", stringify!($layers), " layers")?, "."
                )]
            )?
            #[doc = concat!("Default: `", stringify!($default), "`.")]
            pub $field: $type,
        )*}

        impl Default for $settings {
            fn default() -> Self {
                Self { $($field: $default),* }
            }
        }

        impl $settings {
            /// Checks that each setting is in its range.
            pub(crate) fn check(&self) -> Result<(), $crate::learn::TrainError> {
                $($($crate::learn::settings::range::check_range!(
                    self.$field,
                    stringify!($field),
                    $least..=$most $(in at most $layers layers)?
                )?;)?)*
                Ok(())
            }
        }
    };
}

pub(crate) use {check_range, ranged_settings};

/// Numbers that can be compared with a range.
pub(crate) trait Bounded<N> {
    /// Whether all are in the range. NaN is in none.
    fn is_within(&self, range: std::ops::RangeInclusive<N>) -> bool;
}

impl<N: PartialOrd> Bounded<N> for N {
    fn is_within(&self, range: std::ops::RangeInclusive<N>) -> bool {
        range.contains(self)
    }
}

impl<N: PartialOrd> Bounded<N> for Option<N> {
    fn is_within(&self, range: std::ops::RangeInclusive<N>) -> bool {
        self.as_ref().is_none_or(|number| range.contains(number))
    }
}

impl<N: PartialOrd> Bounded<N> for Vec<N> {
    fn is_within(&self, range: std::ops::RangeInclusive<N>) -> bool {
        self.iter().all(|number| range.contains(number))
    }
}
