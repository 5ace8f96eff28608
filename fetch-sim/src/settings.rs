//! Setters and getters of settings.

/// Defines the setter and the getter of each field that is `Copy`.
macro_rules! settings {
    ($(
        $(#[$setter_doc:meta])* $setter:ident;
        $(#[$getter_doc:meta])* $field:ident: $type:ty;
    )*) => {$(
        $(#[$setter_doc])*
        #[must_use]
        pub const fn $setter(mut self, $field: $type) -> Self {
            self.$field = $field;
            self
        }

        $(#[$getter_doc])*
        #[must_use]
        pub const fn $field(&self) -> $type {
            self.$field
        }
    )*};
}
pub(crate) use settings;
