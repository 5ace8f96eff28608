//! A watch over calls that wait for other processes.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// How often a watch looks.
const INTERVAL: Duration = Duration::from_millis(100);

/// A thread that tells when a call has waited too long for another process. It ends with its watch.
#[derive(Debug)]
pub(super) struct Watch {
    num_waits: AtomicU64,
    state: Arc<State>,
}

#[derive(Debug, Default)]
struct State {
    /// The number of the wait, counted from 1; 0 outside calls.
    wait: AtomicU64,
    /// The process that the call waits for.
    rank: AtomicUsize,
}

impl Watch {
    /// Starts a watch, which calls `on_late` with the process that a call has waited for longer than
    /// `limit`.
    pub(super) fn start(
        limit: Duration,
        on_late: impl Fn(usize) + Send + 'static,
    ) -> std::io::Result<Self> {
        let state = Arc::new(State::default());
        let watched = Arc::downgrade(&state);
        thread::Builder::new().name("watch over ranks".to_owned()).spawn(move || {
            let (mut last_wait, mut waited, mut last_look) = (0, Duration::ZERO, Instant::now());
            while let Some(state) = watched.upgrade() {
                let wait = state.wait.load(Ordering::Acquire);
                // While this process is stopped itself, it does not wait for another one.
                let passed = last_look.elapsed().min(2 * INTERVAL);
                waited =
                    if wait > 0 && wait == last_wait { waited + passed } else { Duration::ZERO };
                (last_wait, last_look) = (wait, Instant::now());
                if waited > limit {
                    on_late(state.rank.load(Ordering::Relaxed));
                    return;
                }
                drop(state);
                thread::sleep(INTERVAL);
            }
        })?;
        Ok(Self { num_waits: AtomicU64::new(0), state })
    }

    /// Watches over a call, until it returns.
    pub(super) fn over<T>(&self, call: impl FnOnce() -> T) -> T {
        let result = call();
        self.state.wait.store(0, Ordering::Release);
        result
    }

    /// Says which process the call waits for from now on.
    pub(super) fn waits_for(&self, rank: usize) {
        self.state.rank.store(rank, Ordering::Relaxed);
        let number = self.num_waits.fetch_add(1, Ordering::Relaxed) + 1;
        self.state.wait.store(number, Ordering::Release);
    }
}
