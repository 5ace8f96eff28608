//! macOS on ARM: everything compiles, and the shim is linked. Nothing is run.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::ensure;
use fetch_install::download;

use super::{Platform, compile_without_mujoco};
use crate::tools::{MUJOCO, ROOT, ZIG, succeeds};

pub(super) const PLATFORM: Platform =
    Platform { name: "aarch64-macos", target: "aarch64-apple-darwin", check };

/// The shim's sources for macOS, as in fetch-sim's build script.
const SOURCES: [&str; 9] = [
    "library",
    "model",
    "data",
    "contact_filter",
    "separation",
    "shapes",
    "loader_dlopen",
    "render",
    "gl_missing",
];

fn check() -> anyhow::Result<bool> {
    Ok(compile_without_mujoco(PLATFORM.target)? && link_shim()?)
}

/// Compiles and links the shim as a separate library.
fn link_shim() -> anyhow::Result<bool> {
    let mujoco = download::mujoco_for(MUJOCO, PLATFORM.name)?;
    let zig = zig()?;
    say!("platforms: zig cc -target aarch64-macos")?;
    let mut compile = Command::new(zig);
    compile
        .current_dir(Path::new(ROOT).join("fetch-sim"))
        .args(["cc", "-target", "aarch64-macos", "-shared", "-std=gnu11", "-O3"])
        .args(["-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-I"])
        .arg(mujoco.join("include"))
        .args(SOURCES.map(|name| format!("shim/{name}.c")))
        .args(["-o", "../target/fetch_shim.dylib"]);
    succeeds(&mut compile)
}

/// Returns the path of Zig, which is installed on first use.
fn zig() -> anyhow::Result<PathBuf> {
    let folder = Path::new(ROOT).join("target/tools").join(ZIG.replace("==", "-"));
    let program = folder.join("ziglang/zig");
    if !program.exists() {
        let mut install = Command::new("python3");
        install.args(["-m", "pip", "install", "--quiet", "--no-deps", "--target"]);
        install.arg(&folder).arg(ZIG);
        ensure!(succeeds(&mut install)?, "pip could not install {ZIG}");
    }
    Ok(program.canonicalize()?)
}
