//! Memory for many rows.

use std::ops::{Deref, DerefMut};

use crate::scalar::Scalar;

/// A slice of zeros on the heap, or on Linux in huge pages if the system provides them. In a table of small
/// pages almost every random access has to look up the page's address, which takes as long as the access.
///
/// The system provides the memory when it is first written.
#[derive(Clone, Debug)]
pub(crate) struct Block<T>(memory::Memory<T>);

impl<T: Scalar> Block<T> {
    /// Makes a block of `len` elements, at least one.
    pub(crate) fn new(len: usize) -> Self {
        Self(memory::Memory::zeroed(len))
    }
}

impl<T: Scalar> Deref for Block<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        self.0.elements()
    }
}

impl<T: Scalar> DerefMut for Block<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        self.0.elements_mut()
    }
}

#[cfg(target_os = "linux")]
mod memory {
    use std::alloc::{Layout, handle_alloc_error};
    use std::marker::PhantomData;

    use memmap2::{Advice, MmapMut};

    use crate::scalar::Scalar;

    #[derive(Debug)]
    pub(super) struct Memory<T> {
        map: MmapMut,
        element: PhantomData<T>,
    }

    impl<T> Memory<T> {
        fn of_bytes(bytes: usize) -> Self {
            let map = MmapMut::map_anon(bytes).unwrap_or_else(|_| {
                // As a `Vec` does when memory runs out.
                handle_alloc_error(Layout::array::<u8>(bytes).unwrap_or(Layout::new::<T>()))
            });
            // Without huge pages, small ones do.
            let _ = map.advise(Advice::HugePage);
            Self { map, element: PhantomData }
        }
    }

    impl<T> Clone for Memory<T> {
        fn clone(&self) -> Self {
            let mut clone = Self::of_bytes(self.map.len());
            clone.map.copy_from_slice(&self.map);
            clone
        }
    }

    impl<T: Scalar> Memory<T> {
        pub(super) fn zeroed(len: usize) -> Self {
            Self::of_bytes(len * size_of::<T>())
        }

        #[inline(always)]
        pub(super) fn elements(&self) -> &[T] {
            bytemuck::cast_slice(&self.map)
        }

        pub(super) fn elements_mut(&mut self) -> &mut [T] {
            bytemuck::cast_slice_mut(&mut self.map)
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod memory {
    use crate::scalar::Scalar;

    #[derive(Clone, Debug)]
    pub(super) struct Memory<T>(Box<[T]>);

    impl<T: Scalar> Memory<T> {
        pub(super) fn zeroed(len: usize) -> Self {
            Self(vec![T::default(); len].into_boxed_slice())
        }

        #[inline(always)]
        pub(super) fn elements(&self) -> &[T] {
            &self.0
        }

        pub(super) fn elements_mut(&mut self) -> &mut [T] {
            &mut self.0
        }
    }
}
