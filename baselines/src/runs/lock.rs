//! The lock of the folder of a run or a grid: one process at a time writes there.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::process;

use her_relabel::files;

use super::error::FolderError;

/// The name of the lock's file. The file stays when the lock is free: removing it could remove the
/// lock of a process that has just taken it.
pub(super) const LOCK: &str = "run.lock";

/// The beginning of the file, so that no file of the user is taken for it.
const START: &str = "process ";

/// The beginning of its second line, before the mark of unfinished files.
const UNFINISHED: &str = "mark of unfinished files: ";

/// The largest size of the file, in bytes.
const LIMIT: u64 = 4096;

/// A lock that its process holds until it is dropped or the process ends, in whatever way.
#[derive(Debug)]
pub(super) struct RunLock {
    folder: PathBuf,
    /// The mark of unfinished files. The next process reads it in the lock's file.
    mark: String,
    has_locks: bool,
    _file: File,
}

impl RunLock {
    /// Takes the lock of a folder, which is made if there is none, and removes the unfinished files
    /// of a killed process.
    pub(super) fn take(folder: &Path) -> Result<Self, FolderError> {
        fs::create_dir_all(folder).map_err(FolderError::file("make", folder))?;
        let path = folder.join(LOCK);
        let mark = format!("{:016x}", rand::random::<u64>());
        let held = Held::open(&path).map_err(FolderError::file("lock", &path))?;
        let Held { mut file, has_locks, is_busy, holder } = held;
        if is_busy {
            let holder = holder.lines().next().filter(|line| !line.is_empty());
            let holder = holder.unwrap_or("another process").to_owned();
            return Err(FolderError::InUse { lock: path, holder });
        }
        let mut begin = || -> io::Result<()> {
            if !holder.is_empty() && !holder.starts_with(START) {
                return Err(io::Error::other("it is not the lock of a run"));
            }
            if has_locks && let Some(mark) = mark_in(&holder) {
                files::remove_unfinished(folder, mark)?;
            }
            file.set_len(0)?;
            file.rewind()?;
            writeln!(file, "{START}{} on {}\n{UNFINISHED}{mark}", process::id(), host())
        };
        begin().map_err(FolderError::file("lock", &path))?;
        Ok(Self { folder: folder.to_owned(), mark, has_locks, _file: file })
    }

    /// Whether other processes are held off: not on a file system without locks.
    pub(super) const fn is_exclusive(&self) -> bool {
        self.has_locks
    }

    /// Replaces a file of the folder, or creates it. It appears whole or not at all. A symbolic link
    /// is replaced.
    pub(super) fn replace(&self, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let path = self.folder.join(name);
        files::replace_marked(&path, &self.mark, |file| file.write_all(bytes))
            .map_err(FolderError::file("write", &path))
    }
}

/// The lock's file, and what it says of the process that has or had it.
struct Held {
    file: File,
    has_locks: bool,
    is_busy: bool,
    holder: String,
}

impl Held {
    fn open(path: &Path) -> io::Result<Self> {
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        // A link may lead to a file of the user.
        #[cfg(unix)]
        {
            use std::os::unix::fs::OpenOptionsExt;

            options.custom_flags(rustix::fs::OFlags::NOFOLLOW.bits().cast_signed());
        }
        let file = options.open(path)?;
        if !fs::symlink_metadata(path)?.is_file() || !file.metadata()?.is_file() {
            return Err(io::Error::other("it is not a regular file"));
        }
        let (has_locks, is_busy) = match file.try_lock() {
            Ok(()) => (true, false),
            Err(TryLockError::WouldBlock) => (true, true),
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                (false, false)
            }
            Err(TryLockError::Error(error)) => return Err(error),
        };
        let mut holder = String::new();
        (&file).take(LIMIT).read_to_string(&mut holder)?;
        Ok(Self { file, has_locks, is_busy, holder })
    }
}

/// Returns the mark of unfinished files from the text of a lock.
fn mark_in(text: &str) -> Option<&str> {
    let mark = text.lines().nth(1)?.strip_prefix(UNFINISHED)?;
    let is_random = mark.len() == 16 && mark.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_random.then_some(mark)
}

/// Returns the name of this machine.
fn host() -> String {
    #[cfg(unix)]
    return rustix::system::uname().nodename().to_string_lossy().into_owned();
    #[cfg(not(unix))]
    std::env::var("COMPUTERNAME").unwrap_or_else(|_| "this machine".to_owned())
}
