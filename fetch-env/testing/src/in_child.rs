//! Part of a test in a forked process.

use std::{
    os::unix::process::{CommandExt, ExitStatusExt},
    panic::{AssertUnwindSafe, catch_unwind},
    process::{Command, ExitStatus, abort},
    thread,
    time::Duration,
};

use fork::{Fork, fork, waitpid};

use crate::Result;

/// Longer than any call here takes: a child that hangs is aborted then.
const FOREVER: Duration = Duration::from_secs(60);

/// Runs a part of a test in a forked child, and fails if that fails or hangs.
pub fn in_child(part: impl FnOnce() -> Result) -> Result {
    match fork()? {
        Fork::Parent(child) => {
            let status = ExitStatus::from_raw(waitpid(child)?);
            if status.success() { Ok(()) } else { Err(format!("the child: {status}").into()) }
        }
        Fork::Child => {
            thread::spawn(|| {
                thread::sleep(FOREVER);
                abort();
            });
            let result = catch_unwind(AssertUnwindSafe(|| part().expect("no error in the child")));
            // Another program replaces this one, so no library's exit handler waits for threads.
            let _failure = Command::new(if result.is_ok() { "true" } else { "false" }).exec();
            abort();
        }
    }
}
