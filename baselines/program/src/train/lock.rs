//! The lock of the folder of a run or a grid: one process at a time writes there.

use std::{
    fs::{self, File, TryLockError},
    io::{self, Read as _, Seek as _, Write as _},
    os::unix::fs::OpenOptionsExt,
    path::{Path, PathBuf},
    process,
};

use crate::output::tell;
use anyhow::{Context, bail, ensure};
use her_relabel::files;
use rustix::{fs::OFlags, system::uname};

/// The name of the lock's file. The file stays when the lock is free: removing it could remove the
/// lock of a process that has just taken it.
pub const LOCK: &str = "run.lock";

/// The beginning of the file, so that no file of the user is taken for it.
const START: &str = "process ";

/// The beginning of its second line, before the mark of unfinished files.
const UNFINISHED: &str = "mark of unfinished files: ";

/// The largest size of the file, in bytes.
const LIMIT: u64 = 4096;

/// A lock that its process holds until it is dropped or the process ends, in whatever way.
pub struct RunLock {
    folder: PathBuf,
    /// The mark of unfinished files. The next process reads it in the lock's file.
    mark: String,
    _file: File,
}

impl RunLock {
    /// Takes the lock of a folder, which is made if there is none, and removes the unfinished files
    /// of a killed process.
    pub fn take(folder: &Path) -> anyhow::Result<Self> {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let path = folder.join(LOCK);
        let mark = format!("{:016x}", rand::random::<u64>());
        let take = || -> anyhow::Result<File> {
            let mut options = File::options();
            options.read(true).write(true).create(true).truncate(false);
            // A link may lead to a file of the user.
            let mut file =
                options.custom_flags(OFlags::NOFOLLOW.bits().cast_signed()).open(&path)?;
            ensure!(file.metadata()?.is_file(), "it is not a regular file");
            let mut has_locks = true;
            let is_busy = match file.try_lock() {
                Ok(()) => false,
                Err(TryLockError::WouldBlock) => true,
                Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                    tell(format_args!(
                        "train: {} is on a file system without locks: let no other process write \
                         there",
                        folder.display()
                    ));
                    has_locks = false;
                    false
                }
                Err(TryLockError::Error(error)) => return Err(error.into()),
            };
            let mut holder = String::new();
            (&file).take(LIMIT).read_to_string(&mut holder)?;
            if is_busy {
                let holder = holder.lines().next().unwrap_or_default();
                let holder = if holder.is_empty() { "another process" } else { holder };
                bail!(
                    "{holder} is using the folder: wait until it has ended, or choose another folder"
                );
            }
            ensure!(holder.is_empty() || holder.starts_with(START), "it is not the lock of a run");
            if has_locks && let Some(mark) = mark_in(&holder) {
                files::remove_unfinished(folder, mark)?;
            }
            let host = uname();
            let host = host.nodename().to_string_lossy();
            file.set_len(0)?;
            file.rewind()?;
            writeln!(file, "{START}{} on {host}\n{UNFINISHED}{mark}", process::id())?;
            Ok(file)
        };
        let file = take().with_context(|| format!("cannot lock {}", path.display()))?;
        Ok(Self { folder: folder.to_owned(), mark, _file: file })
    }

    /// Replaces a file of the folder, or creates it. It appears whole or not at all. A symbolic link
    /// is replaced.
    pub fn replace(&self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let path = self.folder.join(name);
        files::replace_marked(&path, &self.mark, |file| file.write_all(bytes))
            .with_context(|| format!("cannot write {}", path.display()))
    }
}

/// Returns the mark of unfinished files from the text of a lock.
fn mark_in(text: &str) -> Option<&str> {
    let mark = text.lines().nth(1)?.strip_prefix(UNFINISHED)?;
    let is_random = mark.len() == 16 && mark.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_random.then_some(mark)
}
