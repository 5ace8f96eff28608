//! How `main` prints an error.

/// Lets `{:?}` print an error's message and then those of its causes: a program whose `main`
/// returns the error prints `{:?}`, and the messages say what to do.
macro_rules! debug_as_display {
    ($error:ty) => {
        impl std::fmt::Debug for $error {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                std::fmt::Display::fmt(self, f)?;
                let first = std::error::Error::source(self);
                std::iter::successors(first, |&cause| cause.source())
                    .try_for_each(|cause| write!(f, ": {cause}"))
            }
        }
    };
}
