//! The resources that this process holds.

use std::fs;

use anyhow::Context;

/// Memory, handles and threads of this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Held {
    /// Bytes of memory in use.
    pub memory: u64,
    /// Open files, pipes and devices.
    pub handles: usize,
    pub threads: usize,
}

impl Held {
    /// Measures this process.
    pub fn now() -> anyhow::Result<Self> {
        let status =
            fs::read_to_string("/proc/self/status").context("measuring a process needs Linux")?;
        let number = |name: &str| -> anyhow::Result<u64> {
            let line = status.lines().find_map(|line| line.strip_prefix(name));
            let number = line.and_then(|line| line.split_whitespace().next());
            Ok(number.with_context(|| format!("/proc/self/status has no {name}"))?.parse()?)
        };
        Ok(Self {
            memory: 1024 * number("VmRSS:")?,
            // The list itself is open while it is read.
            handles: fs::read_dir("/proc/self/fd")?.count() - 1,
            threads: usize::try_from(number("Threads:")?)?,
        })
    }
}
