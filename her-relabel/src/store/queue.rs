//! A queue in one slice.

use std::ops::{Deref, DerefMut};

/// Elements that are added at the back and taken from the front. Unlike those of a `VecDeque`, they
/// always lie in one slice, in which lookups are faster.
#[derive(Clone, Debug, Default)]
pub(crate) struct Queue<T> {
    items: Vec<T>,
    /// The number of items that were removed.
    front: usize,
}

impl<T> Deref for Queue<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.items[self.front..]
    }
}

impl<T> DerefMut for Queue<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.items[self.front..]
    }
}

impl<T> Extend<T> for Queue<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, items: I) {
        self.items.extend(items);
    }
}

impl<T> Queue<T> {
    pub(crate) fn push(&mut self, item: T) {
        self.items.push(item);
    }

    /// Removes the first element, in constant time on average.
    pub(crate) fn pop_front(&mut self) {
        self.front += usize::from(!self.is_empty());
        // The removed items stay a small part of the memory.
        if self.front > self.len() / 8 + 16 {
            self.items.drain(..self.front);
            self.front = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_is_a_queue(steps in prop::collection::vec((0..60_usize, 0..60_usize), 0..20)) {
            let (mut queue, mut expected) = (Queue::default(), VecDeque::new());
            for (pushed, popped) in steps {
                queue.push(pushed);
                queue.extend(0..pushed);
                expected.push_back(pushed);
                expected.extend(0..pushed);
                for _ in 0..popped {
                    queue.pop_front();
                    expected.pop_front();
                }
                prop_assert!(queue.iter().eq(&expected));
                prop_assert!(queue.items.len() <= 2 * queue.len() + 17);
            }
        }
    }
}
