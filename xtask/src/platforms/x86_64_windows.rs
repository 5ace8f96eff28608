//! Windows: everything compiles, and fetch-sim's tests run in Wine with MuJoCo's own library.

use std::{fs, path::Path, process::Command};

use anyhow::{Context, ensure};
use fetch_install::download;

use super::{MUJOCO, Platform, cargo_for, compile_without_mujoco};
use crate::tools::{ROOT, succeeds};

pub(super) const PLATFORM: Platform =
    Platform { name: "x86_64-windows", target: "x86_64-pc-windows-gnu", check };

/// A library that Rust needs, and Debian's Wine 8 lacks.
const RANDOM_NUMBERS: &str = "
#include <windows.h>
BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);
__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T size) {
  return SystemFunction036(data, (ULONG)size);
}
";

fn check() -> anyhow::Result<bool> {
    Ok(compile_without_mujoco(PLATFORM.target)? && run_tests()?)
}

fn run_tests() -> anyhow::Result<bool> {
    let Platform { name, target, .. } = PLATFORM;
    let mujoco = download::mujoco_for(MUJOCO, name)?;
    let folder = Path::new(ROOT).join("target/wine");
    prepare(&folder)?;
    let folder = folder.canonicalize()?;
    let prefix = folder.to_str().context("the path is not UTF-8")?;
    let variables = [
        ("CARGO_TARGET_X86_64_PC_WINDOWS_GNU_RUNNER", "wine"),
        ("WINEPREFIX", prefix),
        ("WINEDEBUG", "-all"),
        ("TEMP", r"C:\windows\temp"),
    ];
    let run = |arguments: &str| cargo_for(target, arguments, &mujoco, &variables);
    // Rendering is impossible, and must return its own error.
    let passed = run("test -p fetch-sim --no-default-features --features mujoco --tests")?
        && run("test -p fetch-sim --test render -- without_opengl")?;
    // Otherwise it would wait for the next program.
    let mut end = Command::new("wineserver");
    Ok(succeeds(end.arg("--kill").env("WINEPREFIX", prefix)).is_ok() && passed)
}

/// Creates Wine's folder, unless it exists.
fn prepare(folder: &Path) -> anyhow::Result<()> {
    let library = folder.join("drive_c/windows/system32/bcryptprimitives.dll");
    if library.exists() {
        return Ok(());
    }
    fs::create_dir_all(folder)?;
    let folder = folder.canonicalize()?;
    let mut boot = Command::new("wine");
    boot.args(["wineboot", "--init"]).env("WINEPREFIX", &folder).env("WINEDEBUG", "-all");
    ensure!(succeeds(&mut boot)?, "Wine could not make its folder {}", folder.display());
    let source = folder.join("random_numbers.c");
    fs::write(&source, RANDOM_NUMBERS)?;
    let mut compile = Command::new("x86_64-w64-mingw32-gcc");
    compile.arg("-shared").arg(&source).arg("-o").arg(&library).arg("-ladvapi32");
    ensure!(succeeds(&mut compile)?, "{} could not be built", library.display());
    Ok(())
}
