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
    start: Instant,
    state: Arc<State>,
}

#[derive(Debug, Default)]
struct State {
    /// When the call began to wait for the process, in milliseconds since the start of the watch, plus 1; 0 outside calls.
    since: AtomicU64,
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
        let (start, state) = (Instant::now(), Arc::new(State::default()));
        let watched = Arc::downgrade(&state);
        thread::Builder::new().name("watch over ranks".to_owned()).spawn(move || {
            while let Some(state) = watched.upgrade() {
                let since = state.since.load(Ordering::Acquire);
                let waited = start.elapsed().saturating_sub(Duration::from_millis(since));
                if since > 0 && waited > limit {
                    on_late(state.rank.load(Ordering::Relaxed));
                    return;
                }
                drop(state);
                thread::sleep(INTERVAL);
            }
        })?;
        Ok(Self { start, state })
    }

    /// Watches over a call, until it returns.
    pub(super) fn over<T>(&self, call: impl FnOnce() -> T) -> T {
        self.begin();
        let result = call();
        self.state.since.store(0, Ordering::Release);
        result
    }

    /// Says which process the call waits for from now on.
    pub(super) fn waits_for(&self, rank: usize) {
        self.state.rank.store(rank, Ordering::Relaxed);
        self.begin();
    }

    fn begin(&self) {
        let now = self.start.elapsed().as_millis();
        self.state.since.store(u64::try_from(now).unwrap_or(u64::MAX - 1) + 1, Ordering::Release);
    }
}
