//! How `main` prints an error.

/// Lets `{:?}` print an error's message, as `{}` does: a program whose `main` returns the error
/// prints `{:?}`, and the message says what to do.
macro_rules! debug_as_display {
    ($error:ty) => {
        impl std::fmt::Debug for $error {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                std::fmt::Display::fmt(self, f)
            }
        }
    };
}
