//! Setters and getters of settings.

/// Defines chained setters, written `with_field(field: Type);`, and getters, written
/// `field: Type;`, for fields that are `Copy`.
macro_rules! settings {
    () => {};
    ($(#[$doc:meta])* $field:ident: $type:ty; $($rest:tt)*) => {
        $(#[$doc])*
        #[inline]
        #[must_use]
        pub const fn $field(&self) -> $type {
            self.$field
        }

        settings! { $($rest)* }
    };
    ($(#[$doc:meta])* $setter:ident($field:ident: $type:ty); $($rest:tt)*) => {
        $(#[$doc])*
        pub const fn $setter(mut self, $field: $type) -> Self {
            self.$field = $field;
            self
        }

        settings! { $($rest)* }
    };
}
