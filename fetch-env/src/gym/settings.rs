//! Setters and getters of settings.

/// Defines getters of fields that are `Copy`.
macro_rules! getters {
    ($($(#[$doc:meta])* $field:ident: $type:ty,)*) => {$(
        $(#[$doc])*
        #[must_use]
        pub const fn $field(&self) -> $type {
            self.$field
        }
    )*};
}
pub(crate) use getters;

/// Defines chained setters of fields that are `Copy`.
macro_rules! setters {
    ($($(#[$doc:meta])* $setter:ident($field:ident: $type:ty),)*) => {$(
        $(#[$doc])*
        pub const fn $setter(mut self, $field: $type) -> Self {
            self.$field = $field;
            self
        }
    )*};
}
pub(crate) use setters;
