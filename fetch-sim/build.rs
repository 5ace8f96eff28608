//! Finds MuJoCo and compiles the C shim against its headers.
//!
//! The library itself is loaded when it is first used, so a program that depends on this crate
//! needs no linker flags, and a library that does not fit its headers is an error, not a crash.
//! Without headers the crate is built without the shim (`fetch_sim_no_shim`): it compiles, and
//! loading MuJoCo is an error.

use std::{
    env,
    io::{self, ErrorKind},
    path::{Path, PathBuf},
};

use fetch_install::{Found, Places, SYSTEM_PREFIXES, remembering_file};

/// The shim.
const SOURCES: [&str; 6] = ["library", "model", "data", "contact_filter", "separation", "shapes"];

const WAYS_OUT: &str = "install Debian's library (apt-get update && apt-get install -y \
    libmujoco-dev), or download another with `fetch-env mujoco 3.6.0` or `cargo run -p fetch-sim \
    --example download --features download -- mujoco 3.6.0`, or set MUJOCO_DIR to an installation of \
    MuJoCo 2.2 or later: a directory with include/mujoco/mujoco.h, and libmujoco.so in it or in its \
    lib";

fn main() {
    println!("cargo::rustc-check-cfg=cfg(fetch_sim_no_shim)");
    for file in ["build.rs", "shim"] {
        println!("cargo::rerun-if-changed={file}");
    }
    if env::var_os("CARGO_FEATURE_MUJOCO").is_none() {
        return;
    }
    println!("cargo::rerun-if-env-changed=MUJOCO_DIR");
    let variable = |name| env::var(name).unwrap_or_default();
    let (arch, os) = (variable("CARGO_CFG_TARGET_ARCH"), variable("CARGO_CFG_TARGET_OS"));
    let places = Places::for_platform(format!("{arch}-{os}"));
    if places.mujoco_dir.is_none() {
        watch_choice(&places);
    }
    let compiler = || cc::Build::new().get_compiler().to_command();
    match places.find(compiler) {
        Ok(Some(found)) => compile(&found),
        Ok(None) => without_shim(&places),
        // Cargo shows this as the error, and stops.
        Err(wrong) => println!("cargo::error={wrong}. Unset it, or {WAYS_OUT}."),
    }
}

/// Makes Cargo run this script again when the user asks for another MuJoCo, and says if the one that
/// is remembered cannot be used.
fn watch_choice(places: &Places) {
    println!("cargo::rerun-if-env-changed=XDG_CACHE_HOME");
    let Some(cache) = &places.cache else { return };
    let file = remembering_file(cache, &places.platform);
    let watched = if file.exists() { Ok(file) } else { watch_for(&file) };
    // Without a watch, the script runs when something else makes it run.
    if let Ok(watched) = watched {
        println!("cargo::rerun-if-changed={}", watched.display());
    }
    if let Err(unusable) = places.remembered() {
        println!("cargo::warning={unusable}");
    }
}

/// Returns a folder that Cargo finds changed once there is a file of this path. Cargo would run this
/// script in every build if it were told to watch a file that does not exist; in a folder, it passes
/// over links that lead nowhere, and looks at the time of what the others lead to.
#[cfg(unix)]
fn watch_for(file: &Path) -> io::Result<PathBuf> {
    use std::{
        fs::{self, File},
        time::UNIX_EPOCH,
    };

    let out = env::var_os("OUT_DIR").ok_or(ErrorKind::NotFound)?;
    let folder = Path::new(&out).join("watched");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir(&folder)?;
    std::os::unix::fs::symlink(file, folder.join("remembered"))?;
    // Cargo compares with the time at which this script was started.
    File::open(&folder)?.set_modified(UNIX_EPOCH)?;
    Ok(folder)
}

/// Links need privileges on Windows.
#[cfg(not(unix))]
fn watch_for(_file: &Path) -> io::Result<PathBuf> {
    Err(ErrorKind::Unsupported.into())
}

/// Builds the crate without the shim, until there are headers.
fn without_shim(places: &Places) {
    println!("cargo::rustc-cfg=fetch_sim_no_shim");
    if places.mujoco_dir.is_some() {
        return; // as the user asked
    }
    println!(
        "cargo::warning=MuJoCo was not found: simulations return errors until you {WAYS_OUT}; then \
         build again."
    );
    // Cargo would run this script, and rebuild what depends on it, in every build if one of these
    // did not exist.
    for folder in SYSTEM_PREFIXES.iter().filter(|folder| Path::new(folder).is_dir()) {
        println!("cargo::rerun-if-changed={folder}");
    }
}

/// Returns the names of the shim's sources for a system.
fn sources(os: &str) -> impl Iterator<Item = &'static str> {
    let loader = if os == "windows" { "loader_windows" } else { "loader_dlopen" };
    let gl = if ["macos", "windows"].contains(&os) { "gl_missing" } else { "gl_context" };
    let render = env::var_os("CARGO_FEATURE_RENDER").map(|_| ["render", gl]);
    SOURCES.into_iter().chain([loader]).chain(render.into_iter().flatten())
}

fn compile(Found { include, library, .. }: &Found) {
    // The folder, because packages unpack headers with the time stamps of their release.
    println!("cargo::rerun-if-changed={}", include.join("mujoco").display());
    let os = env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    let mut build = cc::Build::new();
    if os != "windows" {
        // A C++ exception of MuJoCo's that searches the stack for a handler stops here, and ends
        // the process. Rust's handlers must not see it: a library that brings its own C++ runtime,
        // as MuJoCo's wheels do, would call them with data of another layout.
        build.flag("-fno-asynchronous-unwind-tables").flag("-fno-unwind-tables");
    }
    build
        .files(sources(&os).map(|name| format!("shim/{name}.c")))
        .include(include)
        .std("gnu11")
        // No fused multiplication and addition, so that results are the same on all processors.
        .flag("-ffp-contract=off")
        .warnings(true)
        .extra_warnings(true)
        .opt_level(3) // the filter is in the hot path of debug builds, too
        .compile("fetch_shim");
    if os == "linux" {
        println!("cargo::rustc-link-lib=dl");
    }
    if let Some(library) = library {
        println!("cargo::rerun-if-changed={}", library.display());
        if env::var_os("CARGO_FEATURE_BUNDLED").is_none() {
            println!("cargo::rustc-env=FETCH_SIM_LIBMUJOCO={}", library.display());
        }
    }
}
