//! Getters of settings.

/// Defines getters of fields that are `Copy`.
macro_rules! getters {
    ($($(#[$doc:meta])* $field:ident: $type:ty,)*) => {$(
        $(#[$doc])*
        #[inline]
        #[must_use]
        pub const fn $field(&self) -> $type {
            self.$field
        }
    )*};
}
pub(crate) use getters;
