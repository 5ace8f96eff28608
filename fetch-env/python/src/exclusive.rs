//! Values that can only be reached through exclusive references.

use std::sync::{Mutex, PoisonError};

/// A value that any thread may use, one at a time, as Python's classes require.
pub(crate) struct Exclusive<T>(Mutex<T>);

impl<T> Exclusive<T> {
    pub(crate) const fn new(value: T) -> Self {
        Self(Mutex::new(value))
    }

    pub(crate) fn get(&mut self) -> &mut T {
        self.0.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}
