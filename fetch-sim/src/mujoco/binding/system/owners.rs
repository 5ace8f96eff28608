//! Checks of who may write to a file before it is loaded, because loading a library runs its code.

use std::{
    fs::{self, Metadata},
    os::unix::fs::MetadataExt,
    path::Path,
};

/// Checks that only this process's user and root can have written a file, or can replace it: that
/// one of them owns it and every folder above it, and that others may write to none of these.
/// Others may write to a sticky folder, such as `/tmp`, where they cannot replace what is not
/// theirs.
///
/// The path must be canonical, so that no link can lead elsewhere.
///
/// # Errors
/// The reason for distrust.
pub(in super::super) fn check_owners(file: &Path) -> Result<(), String> {
    // SAFETY: declared as in C; it only reads.
    unsafe extern "C" {
        safe fn geteuid() -> u32;
    }
    let user = geteuid();
    // A container that does not know root shows a stand-in, which owns `/`.
    let root = look_at(Path::new("/"))?.uid();
    let mut entries: Vec<_> = file.ancestors().collect();
    entries.reverse();
    let mut is_in_shared_folder = false;
    for entry in entries {
        let seen = look_at(entry)?;
        let owner = seen.uid();
        if ![0, user].contains(&owner) && (is_in_shared_folder || owner != root) {
            return Err(format!("{} belongs to another user, {owner}", entry.display()));
        }
        is_in_shared_folder = is_writable_by_others(&seen);
        if is_in_shared_folder && !(seen.is_dir() && seen.mode() & 0o1000 != 0) {
            return Err(format!("others may write to {} (chmod go-w)", entry.display()));
        }
    }
    Ok(())
}

/// Returns whether others may put files into a folder. A folder that cannot be inspected counts as
/// shared.
pub(in super::super) fn is_shared(folder: &Path) -> bool {
    look_at(folder).map_or(true, |seen| is_writable_by_others(&seen))
}

/// Returns whether anyone but its owner may write to an entry. A group with the number of the owner
/// counts as the owner's private group, which most distributions give each user.
fn is_writable_by_others(seen: &Metadata) -> bool {
    let group_is_private = seen.gid() == seen.uid();
    seen.mode() & 0o002 != 0 || (seen.mode() & 0o020 != 0 && !group_is_private)
}

fn look_at(entry: &Path) -> Result<Metadata, String> {
    fs::metadata(entry).map_err(|error| format!("{}: {error}", entry.display()))
}

#[cfg(test)]
mod tests {
    use std::{
        fs::{self, Permissions},
        os::unix::fs::{PermissionsExt, chown},
        path::{Path, PathBuf},
    };

    use super::{check_owners, is_shared};

    type Result<T = ()> = std::io::Result<T>;

    /// A folder with the file `inner/library`, which only the user may write.
    struct Folder(tempfile::TempDir);

    impl Folder {
        fn new() -> Result<Self> {
            let folder = Self(tempfile::tempdir()?);
            fs::create_dir(folder.path("inner")?)?;
            fs::write(folder.path("inner")?.join("library"), "")?;
            for name in ["inner", "inner/library"] {
                folder.allow(name, 0o755)?;
            }
            Ok(folder)
        }

        fn path(&self, name: &str) -> Result<PathBuf> {
            Ok(self.0.path().canonicalize()?.join(name))
        }

        fn allow(&self, name: &str, mode: u32) -> Result {
            fs::set_permissions(self.path(name)?, Permissions::from_mode(mode))
        }

        fn refusal(&self) -> Result<Option<String>> {
            Ok(check_owners(&self.path("inner/library")?).err())
        }
    }

    #[test]
    fn what_others_may_write_is_refused() -> Result {
        let folder = Folder::new()?;
        assert_eq!(folder.refusal()?, None);
        for name in ["inner", "inner/library"] {
            folder.allow(name, 0o757)?;
            let refusal = folder.refusal()?.unwrap_or_default();
            let path = folder.path(name)?;
            assert_eq!(refusal, format!("others may write to {} (chmod go-w)", path.display()));
            folder.allow(name, 0o755)?;
        }
        folder.allow("inner/library", 0o1757)?;
        assert!(folder.refusal()?.is_some(), "only folders are sticky");
        Ok(())
    }

    #[test]
    fn a_sticky_folder_may_be_shared() -> Result {
        let folder = Folder::new()?;
        folder.allow("inner", 0o1777)?;
        assert_eq!(folder.refusal()?, None);
        assert!(is_shared(&folder.path("inner")?));
        assert!(!is_shared(&folder.path("")?));
        assert!(is_shared(Path::new("/nonexistent")));
        Ok(())
    }

    /// Only root can give files away.
    #[test]
    fn what_belongs_to_others_is_refused() -> Result {
        let folder = Folder::new()?;
        for name in ["inner/library", "inner"] {
            if chown(folder.path(name)?, Some(12345), Some(12345)).is_err() {
                return Ok(());
            }
            let refusal = folder.refusal()?.unwrap_or_default();
            assert!(refusal.ends_with("belongs to another user, 12345"), "{refusal}");
            chown(folder.path(name)?, Some(0), Some(0))?;
        }
        // A group that is not the owner's own.
        chown(folder.path("inner")?, None, Some(12345))?;
        folder.allow("inner", 0o775)?;
        assert!(folder.refusal()?.is_some());
        chown(folder.path("inner")?, None, Some(0))?;
        folder.allow("inner", 0o775)?;
        assert_eq!(folder.refusal()?, None);
        Ok(())
    }
}
