//! Work that a fork waits for.
//!
//! A forked child has none of its parent's other threads, but all that they have locked or half
//! done. So a fork waits until no thread loads a library or compiles a model, and threads that want
//! to wait until the fork is over. The work calls nothing of the host's, which could wait for the
//! thread that forks.

#[cfg(unix)]
use std::{
    cell::RefCell,
    ffi::c_int,
    sync::{
        PoisonError, RwLock, RwLockWriteGuard,
        atomic::{AtomicBool, Ordering::SeqCst},
    },
};

/// Read while work is done, and written during a fork. (The standard library's lets the writer go
/// first, so that work without a pause never keeps a fork waiting.)
#[cfg(unix)]
static WORK: RwLock<()> = RwLock::new(());

#[cfg(unix)]
thread_local! {
    /// The lock of the thread that forks.
    static FORKING: RefCell<Option<RwLockWriteGuard<'static, ()>>> = const { RefCell::new(None) };
}

/// Does work that no fork interrupts. The work must not call this function.
#[cfg(unix)]
pub(super) fn unforked<T>(work: impl FnOnce() -> T) -> T {
    register();
    let _working = WORK.read().unwrap_or_else(PoisonError::into_inner);
    work()
}

/// Does work; there are no forks on this system.
#[cfg(not(unix))]
pub(super) fn unforked<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// Registers the handlers. Threads that do so at the same time do it twice, which changes nothing;
/// a lock here could itself be held during a fork.
#[cfg(unix)]
fn register() {
    static REGISTERED: AtomicBool = AtomicBool::new(false);
    if !REGISTERED.load(SeqCst) {
        // SAFETY: the handlers take no arguments and do not unwind, and live as long as the code
        // that registers them.
        unsafe { pthread_atfork(Some(before), Some(after), Some(after)) };
        REGISTERED.store(true, SeqCst);
    }
}

#[cfg(unix)]
unsafe extern "C" {
    fn pthread_atfork(
        prepare: Option<extern "C" fn()>,
        parent: Option<extern "C" fn()>,
        child: Option<extern "C" fn()>,
    ) -> c_int;
}

/// Waits for the work of all threads, unless the thread that forks is ending, and has no local
/// storage any more.
#[cfg(unix)]
extern "C" fn before() {
    let _ = FORKING.try_with(|forking| {
        let mut forking = forking.borrow_mut();
        if forking.is_none() {
            *forking = Some(WORK.write().unwrap_or_else(PoisonError::into_inner));
        }
    });
}

/// Lets work go on, in the parent and in the child.
#[cfg(unix)]
extern "C" fn after() {
    let _ = FORKING.try_with(|forking| forking.borrow_mut().take());
}
