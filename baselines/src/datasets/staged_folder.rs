//! Folders that appear whole or not at all.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, TempDir};

use super::error::DatasetError;

/// A folder below a root that is filled in another place, `.NAME.xxxxxx/contents` in the root, and
/// then renamed.
///
/// Dropping the value removes `.NAME.xxxxxx`, and the root if it was new and nothing else is in it.
/// A process that is killed leaves them, and the next one that begins a folder there removes them.
#[derive(Debug)]
pub(super) struct StagedFolder {
    target: PathBuf,
    /// The folder that is filled.
    contents: PathBuf,
    _staging: TempDir,
    /// Its lock says that this process still runs.
    _mark: File,
    /// The root, if it is new, and its new parents; dropped last.
    _root: NewFolders,
}

/// The name of the folder that is filled.
const CONTENTS: &str = "contents";
/// The name of the file that proves whose the folder around it is.
const MARK: &str = "unfinished";
/// The contents of that file, before the number of the folder's parents that are new.
const MARKED: &str = "An unfinished data set of fetch-baselines; new parents: ";

impl StagedFolder {
    /// Creates the folder with a name below a root in its temporary place, and the root if there is
    /// none. It first removes what killed processes have left in the root.
    pub(super) fn create(root: &Path, name: &str) -> Result<Self, DatasetError> {
        let target = root.join(name);
        if fs::symlink_metadata(&target).is_ok() {
            return Err(DatasetError::Exists { path: target });
        }
        let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
        let made = NewFolders::create(root).map_err(DatasetError::file(root))?.with_left(root);
        let name = target.file_name().unwrap_or_default().to_string_lossy();
        let prefix = format!(".{name}.");
        let mut builder = Builder::new();
        builder.prefix(&prefix);
        // The permissions of an ordinary folder: by default only its owner could read it.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let staging = builder.tempdir_in(root).map_err(DatasetError::file(root))?;
        let path = staging.path().join(MARK);
        let mark = mark(&path, made.0.len()).map_err(DatasetError::file(&path))?;
        let contents = staging.path().join(CONTENTS);
        fs::create_dir(&contents).map_err(DatasetError::file(&contents))?;
        Ok(Self { target, contents, _staging: staging, _mark: mark, _root: made })
    }

    pub(super) fn path(&self) -> &Path {
        &self.contents
    }

    /// Writes a file of JSON in the folder.
    #[cfg(feature = "ogbench")]
    pub(super) fn write_json(
        &self,
        name: &str,
        value: &impl serde::Serialize,
    ) -> Result<(), DatasetError> {
        let path = self.path().join(name);
        let json = serde_json::to_string_pretty(value).map_err(io::Error::other);
        json.and_then(|json| fs::write(&path, json + "\n")).map_err(DatasetError::file(&path))
    }

    /// Renames the folder to its final name.
    pub(super) fn publish(self) -> Result<(), DatasetError> {
        let Self { target, contents, .. } = &self;
        // Those that are new are removed if the name is taken.
        let _parents = target.parent().map(NewFolders::create).transpose();
        match fs::rename(contents, target) {
            Ok(()) => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => {
                Err(DatasetError::Exists { path: target.clone() })
            }
            Err(error) => Err(DatasetError::file(target)(error)),
        }
    }
}

/// Creates the file that proves later whose the folder around it is.
fn mark(path: &Path, num_parents: usize) -> io::Result<File> {
    let mut file = File::create_new(path)?;
    // Without locks nothing tells whether this process still runs, and so nothing is proved.
    if file.lock().is_ok() {
        // In one call, so that a killed process leaves the whole mark or none.
        file.write_all(format!("{MARKED}{num_parents}\n").as_bytes())?;
    }
    Ok(file)
}

/// The new folders among those that lead to a place, the innermost first. Dropping them removes
/// those in which there is nothing.
#[derive(Debug)]
struct NewFolders(Vec<PathBuf>);

/// Returns a folder and its parents, the innermost first.
fn ancestors(folder: &Path) -> impl Iterator<Item = &Path> {
    folder.ancestors().filter(|path| !path.as_os_str().is_empty())
}

impl NewFolders {
    /// Makes a folder and the parents that it does not have.
    fn create(folder: &Path) -> io::Result<Self> {
        let missing = ancestors(folder).take_while(|path| !path.exists());
        let new = Self(missing.map(Path::to_owned).collect());
        fs::create_dir_all(folder)?;
        Ok(new)
    }

    /// Removes what killed processes have left in a root. The folders that lead to it are also new
    /// if they were new to one of those, or to a process that still writes there.
    fn with_left(mut self, root: &Path) -> Self {
        // Nothing is removed from a root that cannot be listed.
        let entries = fs::read_dir(root).into_iter().flatten().flatten();
        let counts = entries.filter_map(|entry| remove_left(&entry));
        if let Some(count) = counts.max().filter(|count| *count > self.0.len()) {
            self.0 = ancestors(root).take(count).map(Path::to_owned).collect();
        }
        self
    }
}

impl Drop for NewFolders {
    fn drop(&mut self) {
        for folder in &self.0 {
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Removes a folder if it provably is what a killed process has left. Returns the number of new
/// parents of a folder that has the mark.
fn remove_left(entry: &fs::DirEntry) -> Option<usize> {
    let (folder, name) = (entry.path(), entry.file_name());
    if !name.as_encoded_bytes().starts_with(b".") || !entry.file_type().ok()?.is_dir() {
        return None;
    }
    let path = folder.join(MARK);
    if !fs::symlink_metadata(&path).ok()?.is_file() {
        return None;
    }
    let file = File::options().read(true).write(true).open(path).ok()?;
    let mut text = String::new();
    (&file).take(2 * MARKED.len() as u64).read_to_string(&mut text).ok()?;
    let count = text.strip_prefix(MARKED)?.trim_end().parse().ok()?;
    let is_ours = |name: &OsStr| name == MARK || name == CONTENTS;
    let mut inside = fs::read_dir(&folder).ok()?;
    let is_ours = inside.all(|entry| entry.is_ok_and(|entry| is_ours(&entry.file_name())));
    // A process that still writes has the lock.
    if is_ours && file.try_lock().is_ok() {
        let _ = fs::remove_dir_all(folder);
    }
    Some(count)
}
