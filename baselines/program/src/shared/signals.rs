//! Signals: Ctrl-C in a terminal (SIGINT) and SIGTERM, which end a command at once or after a last
//! step.

use std::{
    fmt, io,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag,
    low_level::signal_name,
};

/// Signals to this process, in all clones of one value. The first one can be put off; the next one
/// ends the process at once.
#[derive(Clone)]
pub struct Signals {
    end_at_once: Arc<AtomicBool>,
    /// The last signal; 0 for none.
    received: Arc<AtomicUsize>,
}

impl Signals {
    /// Listens for signals, which still end the process at once.
    pub fn listen() -> io::Result<Self> {
        let end_at_once = Arc::new(AtomicBool::new(true));
        let received = Arc::new(AtomicUsize::new(0));
        for signal in [SIGINT, SIGTERM] {
            // In this order: the first one does not end the process itself.
            flag::register_conditional_default(signal, Arc::clone(&end_at_once))?;
            flag::register(signal, Arc::clone(&end_at_once))?;
            flag::register_usize(signal, Arc::clone(&received), signal as usize)?;
        }
        Ok(Self { end_at_once, received })
    }

    /// Puts off the next signal, until the value that is returned is dropped.
    #[must_use]
    pub fn put_off(&self) -> PutOff<'_> {
        self.end_at_once.store(false, Ordering::SeqCst);
        PutOff(self)
    }

    /// Returns the signal that was put off; 0 for none.
    pub fn received(&self) -> usize {
        self.received.load(Ordering::SeqCst)
    }
}

/// The time in which a signal is put off: after it, the next one ends the process at once.
pub struct PutOff<'a>(&'a Signals);

impl Drop for PutOff<'_> {
    fn drop(&mut self) {
        self.0.end_at_once.store(true, Ordering::SeqCst);
    }
}

/// Why a command ended after it received a signal.
#[derive(Clone, Copy, Debug)]
pub struct Stopped(usize);

impl Stopped {
    /// Returns why a command ends if it has received this signal; 0 is no signal.
    pub fn by(signal: usize) -> Option<Self> {
        (signal != 0).then_some(Self(signal))
    }

    /// Returns the exit code that a shell reports for a process ended by this signal.
    pub fn exit_code(self) -> u8 {
        u8::try_from(128 + self.0).unwrap_or(u8::MAX)
    }
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = i32::try_from(self.0).ok().and_then(signal_name).unwrap_or("a signal");
        write!(f, "stopped by {name}")
    }
}

impl std::error::Error for Stopped {}
