//! Objects that the living environments of a process share.

use std::{
    process,
    sync::{Arc, Mutex, PoisonError, Weak},
};

use once_cell::race::OnceBox;

/// A list of objects, each made for the first of those who share it, who own it.
///
/// The list is locked while an object is made. In a forked child, a thread of the parent may have
/// locked it for ever, so each process has a list of its own. A child's list begins with what its
/// parent's had, unless that was locked.
pub(crate) struct Shared<T> {
    first: OnceBox<List<T>>,
}

struct List<T> {
    process: u32,
    objects: Mutex<Vec<Weak<T>>>,
    /// The list of a child that this process forked, in that child.
    child: OnceBox<Self>,
}

impl<T> Shared<T> {
    pub(crate) const fn new() -> Self {
        Self { first: OnceBox::new() }
    }

    /// Returns the living object that fits, or makes one.
    ///
    /// # Errors
    /// As `make`.
    pub(crate) fn get_or_make<E>(
        &self,
        fits: impl Fn(&T) -> bool,
        make: impl FnOnce() -> Result<Arc<T>, E>,
    ) -> Result<Arc<T>, E> {
        // A panic while the list is locked leaves it valid.
        let objects = &self.list().objects;
        let mut objects = objects.lock().unwrap_or_else(PoisonError::into_inner);
        objects.retain(|object| object.strong_count() > 0);
        let mut alive = objects.iter().filter_map(Weak::upgrade);
        if let Some(object) = alive.find(|object| fits(object)) {
            return Ok(object);
        }
        drop(alive);
        let object = make()?;
        objects.push(Arc::downgrade(&object));
        Ok(object)
    }

    /// Returns the list of this process. (A `OnceBox` is set without waiting for another thread.)
    fn list(&self) -> &List<T> {
        let own = process::id();
        let mut list = self.first.get_or_init(|| List::new(own, Vec::new()));
        while list.process != own {
            let parents = || list.objects.try_lock().map_or_else(|_| Vec::new(), |all| all.clone());
            list = list.child.get_or_init(|| List::new(own, parents()));
        }
        list
    }
}

impl<T> List<T> {
    fn new(process: u32, objects: Vec<Weak<T>>) -> Box<Self> {
        Box::new(Self { process, objects: Mutex::new(objects), child: OnceBox::new() })
    }
}
