//! A watch over calls that wait for other processes.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::Awaited;

/// How often a watch looks.
const INTERVAL: Duration = Duration::from_millis(100);

/// A thread that reports a call that has waited too long for another process. It ends with its
/// watch.
#[derive(Debug)]
pub(super) struct Watch {
    wait: Arc<Mutex<Wait>>,
}

#[derive(Debug, Default)]
struct Wait {
    /// How many waits have begun.
    number: u64,
    /// What the last one is for; nothing outside calls.
    awaited: Option<Awaited>,
}

impl Watch {
    /// Starts a watch, which calls `on_late` with what a call has waited for longer than `limit`.
    pub(super) fn start(
        limit: Duration,
        on_late: impl Fn(Awaited) + Send + 'static,
    ) -> std::io::Result<Self> {
        let wait = Arc::<Mutex<Wait>>::default();
        let watched = Arc::downgrade(&wait);
        thread::Builder::new().name("watch over ranks".to_owned()).spawn(move || {
            let (mut last_number, mut waited, mut last_look) = (0, Duration::ZERO, Instant::now());
            while let Some(wait) = watched.upgrade() {
                let Wait { number, awaited } = *lock(&wait);
                // While this process is stopped itself, it does not wait for another one.
                let passed = last_look.elapsed().min(2 * INTERVAL);
                last_look = Instant::now();
                if let Some(awaited) = awaited.filter(|_| number == last_number) {
                    waited += passed;
                    if waited > limit {
                        on_late(awaited);
                        return;
                    }
                } else {
                    waited = Duration::ZERO;
                }
                last_number = number;
                drop(wait);
                thread::sleep(INTERVAL);
            }
        })?;
        Ok(Self { wait })
    }

    /// Watches over a call, until it returns.
    pub(super) fn over<T>(&self, call: impl FnOnce() -> T) -> T {
        let result = call();
        lock(&self.wait).awaited = None;
        result
    }

    /// Says what the call waits for from now on.
    pub(super) fn waits_for(&self, awaited: Awaited) {
        let mut wait = lock(&self.wait);
        wait.number += 1;
        wait.awaited = Some(awaited);
    }
}

fn lock(wait: &Mutex<Wait>) -> MutexGuard<'_, Wait> {
    wait.lock().unwrap_or_else(PoisonError::into_inner)
}
