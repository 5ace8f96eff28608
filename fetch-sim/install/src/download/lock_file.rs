//! A file that is locked, and removed by the process that held the lock, unless another process has
//! it by then.

use std::{
    fs::{self, File},
    io,
    path::Path,
};

/// A locked file. On Unix it is removed while it is locked, so a lock may turn out to belong to a
/// file that no longer has a name.
#[cfg(unix)]
pub(super) struct LockFile(#[expect(dead_code, reason = "it is unlocked when it is dropped")] File);

#[cfg(unix)]
impl LockFile {
    /// Creates a file unless it exists, and waits for its lock; returns `None` if the file was
    /// removed meanwhile.
    pub(super) fn lock(path: &Path) -> io::Result<Option<Self>> {
        use std::os::unix::fs::MetadataExt;

        let file = File::options().write(true).create(true).truncate(false).open(path)?;
        file.lock()?;
        let (Ok(open), Ok(there)) = (file.metadata(), fs::metadata(path)) else { return Ok(None) };
        let is_there = (open.dev(), open.ino()) == (there.dev(), there.ino());
        Ok(is_there.then_some(Self(file)))
    }

    /// Removes the file.
    pub(super) fn remove(&mut self, path: &Path) {
        let _ = fs::remove_file(path);
    }
}

/// A locked file. Windows refuses to remove it while any process has it open.
#[cfg(windows)]
pub(super) struct LockFile(Option<File>);

#[cfg(windows)]
impl LockFile {
    /// Creates a file unless it exists, and waits for its lock. It never returns `None`, which is
    /// only for Unix.
    pub(super) fn lock(path: &Path) -> io::Result<Option<Self>> {
        use std::os::windows::fs::OpenOptionsExt;

        // FILE_SHARE_READ and FILE_SHARE_WRITE, without FILE_SHARE_DELETE.
        const SHARED: u32 = 1 | 2;
        let mut options = File::options();
        options.write(true).create(true).truncate(false).share_mode(SHARED);
        let file = options.open(path)?;
        file.lock()?;
        Ok(Some(Self(Some(file))))
    }

    /// Unlocks the file, and removes it unless another process waits for it.
    pub(super) fn remove(&mut self, path: &Path) {
        self.0 = None;
        let _ = fs::remove_file(path);
    }
}
