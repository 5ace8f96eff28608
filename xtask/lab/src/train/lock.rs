//! The lock of a run's folder: one process at a time writes there.

use std::{
    fs::{self, File, TryLockError},
    io::{self, Read as _, Seek as _, Write as _},
    os::unix::fs::OpenOptionsExt,
    path::Path,
    process,
};

use anyhow::{Context, bail, ensure};
use commands::tell;
use rustix::{fs::OFlags, system::uname};

/// The name of the lock's file. The file stays when the lock is free: removing it could remove the
/// lock of a process that has just taken it.
pub const LOCK: &str = "run.lock";

/// The beginning of the file, so that no file of the user is taken for it.
const MARK: &str = "process ";

/// A lock that its process holds until it is dropped or the process ends, in whatever way.
pub struct RunLock {
    _file: File,
}

impl RunLock {
    /// Takes the lock of a folder, which is made if there is none.
    pub fn take(folder: &Path) -> anyhow::Result<Self> {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let path = folder.join(LOCK);
        let take = || -> anyhow::Result<File> {
            let mut options = File::options();
            options.read(true).write(true).create(true).truncate(false);
            // A link may lead to a file of the user.
            let mut file =
                options.custom_flags(OFlags::NOFOLLOW.bits().cast_signed()).open(&path)?;
            ensure!(file.metadata()?.is_file(), "it is not a regular file");
            let is_busy = match file.try_lock() {
                Ok(()) => false,
                Err(TryLockError::WouldBlock) => true,
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                    tell(format_args!(
                        "train: {} is on a file system without locks: let no other process write \
                         there",
                        folder.display()
                    ));
                    false
                }
                Err(TryLockError::Error(error)) => return Err(error.into()),
            };
            let mut holder = String::new();
            file.read_to_string(&mut holder)?;
            if is_busy {
                let holder = holder.trim_end();
                let holder = if holder.is_empty() { "another process" } else { holder };
                bail!(
                    "{holder} is using the folder: wait until it has ended, or choose another folder"
                );
            }
            ensure!(holder.is_empty() || holder.starts_with(MARK), "it is not the lock of a run");
            let host = uname();
            let host = host.nodename().to_string_lossy();
            file.set_len(0)?;
            file.rewind()?;
            writeln!(file, "{MARK}{} on {host}", process::id())?;
            Ok(file)
        };
        let file = take().with_context(|| format!("cannot lock {}", path.display()))?;
        Ok(Self { _file: file })
    }
}
