//! Arrays that observations own, in reused memory.

use std::{fmt, ops::Deref, sync::Arc};

use crate::gym::env::observation::{ArrayRows, BatchObservation};
use crate::gym::spaces::element::ArrayElement;

/// An observation that is an array of numbers or of the bytes of pictures, row-major. Clones share
/// its elements.
#[derive(Clone, PartialEq)]
pub struct SharedArray<T>(Arc<[T]>);

impl<T> Deref for SharedArray<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T> AsRef<[T]> for SharedArray<T> {
    fn as_ref(&self) -> &[T] {
        self
    }
}

impl<T: Clone> From<&[T]> for SharedArray<T> {
    fn from(array: &[T]) -> Self {
        Self(array.into())
    }
}

impl<T> From<Vec<T>> for SharedArray<T> {
    fn from(array: Vec<T>) -> Self {
        Self(array.into())
    }
}

/// Shows the first hundred elements: enough of a picture.
impl<T: fmt::Debug> fmt::Debug for SharedArray<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut list = f.debug_list();
        list.entries(self.iter().take(100));
        if self.len() > 100 { list.finish_non_exhaustive() } else { list.finish() }
    }
}

impl<T: ArrayElement> BatchObservation for SharedArray<T> {
    type Rows = ArrayRows<T>;
}

/// A pool of arrays of one length, which reuses the memory of dropped arrays.
///
/// As long as no more than [`REMEMBERED`](Self::REMEMBERED) arrays are alive at once, each of them
/// is allocated once.
#[derive(Debug)]
pub(crate) struct ArrayPool<T> {
    len: usize,
    /// The last arrays, the oldest first.
    recent: Vec<SharedArray<T>>,
}

impl<T> ArrayPool<T> {
    /// The number of arrays whose memory is remembered.
    const REMEMBERED: usize = 4;

    /// Creates a pool of arrays of `len` elements.
    pub(crate) fn new(len: usize) -> Self {
        Self { len, recent: Vec::with_capacity(Self::REMEMBERED) }
    }
}

impl<T: ArrayElement> ArrayPool<T> {
    /// Returns an array that `fill` has written. Before that, its elements are those of an earlier
    /// array.
    pub(crate) fn write(&mut self, fill: impl FnOnce(&mut [T])) -> SharedArray<T> {
        let is_free = |array: &mut SharedArray<T>| Arc::get_mut(&mut array.0).is_some();
        let mut array = match self.recent.iter_mut().position(is_free) {
            Some(index) => self.recent.remove(index),
            None => SharedArray(vec![T::EMPTY; self.len].into()),
        };
        if let Some(elements) = Arc::get_mut(&mut array.0) {
            fill(elements);
        }
        if self.recent.len() == Self::REMEMBERED {
            self.recent.remove(0);
        }
        self.recent.push(array.clone());
        array
    }
}

/// A clone remembers nothing, so that the two never wait for each other's arrays.
impl<T> Clone for ArrayPool<T> {
    fn clone(&self) -> Self {
        Self::new(self.len)
    }
}
