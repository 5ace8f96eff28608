//! Memory for many rows.
//!
//! A [`Block`] is a slice of zeros on the heap, or on Linux in huge pages if the system provides
//! them. With small pages, almost every random access has to look up the page's address, which
//! takes as long as the access itself.
//!
//! The system provides the memory when it is first written. Miri does not support huge pages.

#[cfg(all(target_os = "linux", not(miri)))]
pub(crate) use huge::{Block, zeroed};
#[cfg(any(not(target_os = "linux"), miri))]
pub(crate) use plain::{Block, zeroed};

#[cfg(all(target_os = "linux", not(miri)))]
mod huge {
    use std::alloc::{Layout, handle_alloc_error};
    use std::marker::PhantomData;
    use std::ops::{Deref, DerefMut};

    use memmap2::{Advice, MmapMut};

    use crate::scalar::Scalar;

    /// A slice in its own memory map.
    #[derive(Debug)]
    pub(crate) struct Block<T> {
        map: MmapMut,
        element: PhantomData<T>,
    }

    /// Creates a block of `len` elements, at least one.
    pub(crate) fn zeroed<T: Scalar>(len: usize) -> Block<T> {
        Block::of_bytes(len * size_of::<T>())
    }

    impl<T> Block<T> {
        fn of_bytes(bytes: usize) -> Self {
            let map = MmapMut::map_anon(bytes).unwrap_or_else(|_| {
                // Like a `Vec` when memory runs out.
                handle_alloc_error(Layout::array::<u8>(bytes).unwrap_or(Layout::new::<T>()))
            });
            // If there are no huge pages, small ones are used.
            let _ = map.advise(Advice::HugePage);
            Self { map, element: PhantomData }
        }
    }

    impl<T> Clone for Block<T> {
        fn clone(&self) -> Self {
            let mut clone = Self::of_bytes(self.map.len());
            clone.map.copy_from_slice(&self.map);
            clone
        }
    }

    impl<T: Scalar> Deref for Block<T> {
        type Target = [T];

        #[inline(always)]
        fn deref(&self) -> &[T] {
            bytemuck::cast_slice(&self.map)
        }
    }

    impl<T: Scalar> DerefMut for Block<T> {
        fn deref_mut(&mut self) -> &mut [T] {
            bytemuck::cast_slice_mut(&mut self.map)
        }
    }
}

#[cfg(any(not(target_os = "linux"), miri))]
mod plain {
    use crate::scalar::Scalar;

    pub(crate) type Block<T> = Box<[T]>;

    /// Creates a block of `len` elements.
    pub(crate) fn zeroed<T: Scalar>(len: usize) -> Block<T> {
        vec![T::default(); len].into_boxed_slice()
    }
}
