//! Windows: everything compiles, and fetch-sim's tests run in Wine with MuJoCo's own library.

use std::{fs, path::Path, process::Command};

use anyhow::{Context, ensure};
use fetch_install::download;

use super::{Platform, cargo_for, compile_without_mujoco};
use crate::tools::{MUJOCO, ROOT, succeeds};

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
    let wine = variables()?;
    let mut variables = vec![("CARGO_TARGET_X86_64_PC_WINDOWS_GNU_RUNNER", "wine")];
    variables.extend(wine.iter().map(|(name, value)| (*name, value.as_str())));
    let run = |arguments: &str| cargo_for(target, arguments, &mujoco, &variables);
    // Rendering is impossible, and must return its own error.
    let passed = run("test -p fetch-sim --no-default-features --features mujoco --tests")?
        && run("test -p fetch-sim --test render -- without_opengl")?;
    Ok(end(&wine) && passed)
}

/// Returns the variables with which Wine runs in a folder of this workspace's own, which is made on
/// the first call.
pub(crate) fn variables() -> anyhow::Result<[(&'static str, String); 3]> {
    let folder = Path::new(ROOT).join("target/wine");
    prepare(&folder)?;
    let folder = folder.canonicalize()?;
    let prefix = folder.to_str().context("the path is not UTF-8")?;
    Ok([
        ("WINEPREFIX", prefix.into()),
        ("WINEDEBUG", "-all".into()),
        ("TEMP", r"C:\windows\temp".into()),
    ])
}

/// Ends Wine, which would wait for the next program, and returns whether it could.
pub(crate) fn end(variables: &[(&'static str, String)]) -> bool {
    let mut end = Command::new("wineserver");
    succeeds(end.arg("--kill").envs(variables.iter().cloned())).is_ok()
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
