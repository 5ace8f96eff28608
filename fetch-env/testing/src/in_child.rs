//! Part of a test in a forked process.

use std::{
    os::unix::process::{CommandExt, ExitStatusExt},
    panic::{AssertUnwindSafe, catch_unwind},
    process::{Command, ExitStatus, abort},
    thread,
    time::{Duration, Instant},
};

use fork::{Fork, fork, waitpid, waitpid_nohang};

use crate::Result;

/// Longer than any call here takes: a child that hangs is killed then.
const FOREVER: Duration = Duration::from_secs(60);

/// The time between two looks at a child.
const PAUSE: Duration = Duration::from_millis(1);

/// Runs a part of a test in a forked child, and fails if that fails or hangs.
pub fn in_child(part: impl FnOnce() -> Result) -> Result {
    match fork()? {
        Fork::Parent(child) => {
            // Watched from here: a thread of the child might hang as well.
            let start = Instant::now();
            let status = loop {
                if let Some(status) = waitpid_nohang(child)? {
                    break ExitStatus::from_raw(status);
                }
                if start.elapsed() > FOREVER {
                    Command::new("kill").args(["-KILL", &child.to_string()]).status()?;
                    waitpid(child)?;
                    return Err("the child hangs".into());
                }
                thread::sleep(PAUSE);
            };
            if status.success() { Ok(()) } else { Err(format!("the child: {status}").into()) }
        }
        Fork::Child => {
            let result = catch_unwind(AssertUnwindSafe(|| part().expect("no error in the child")));
            // Another program replaces this one, so no library's exit handler waits for threads.
            let _failure = Command::new(if result.is_ok() { "true" } else { "false" }).exec();
            abort();
        }
    }
}
