//! Numbers that identify vectors of environments.

use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicU64, Ordering};
use std::{process, time::SystemTime};

/// Returns a number that no other vector has, in this process or another: replay buffers travel
/// between processes. A forked process has its parent's keys and count, but its own id.
pub(super) fn unique_number() -> u64 {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    RandomState::new().hash_one((process::id(), count, SystemTime::now()))
}
