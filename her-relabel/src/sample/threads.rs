//! The threads that draw large batches.

use std::process;
use std::sync::atomic::{AtomicU32, Ordering::SeqCst};

/// Returns whether threads help to draw. They do not in a process that was forked from one that has
/// drawn with them, because the child has none of the pool's threads and would wait forever. In a
/// pool that the child created, they do.
pub(crate) fn have_threads() -> bool {
    /// The first process that has drawn with threads.
    static PROCESS: AtomicU32 = AtomicU32::new(NONE);
    const NONE: u32 = 0;
    let own = process::id();
    let first = PROCESS.compare_exchange(NONE, own, SeqCst, SeqCst).unwrap_or_else(|first| first);
    [NONE, own].contains(&first) || rayon::current_thread_index().is_some()
}
