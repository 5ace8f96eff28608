//! Finds MuJoCo and compiles the C shim against its headers.
//!
//! The library itself is loaded when it is first used, so that a program that depends on this
//! crate needs no linker flags, and a library that does not fit its headers is an error and not a
//! crash.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

const SYSTEM_PREFIXES: [&str; 2] = ["/usr/local/include", "/usr/include"];

/// The shim.
const SOURCES: [&str; 7] = [
    "shim/load.c",
    "shim/guard.c",
    "shim/model.c",
    "shim/data.c",
    "shim/contact_filter.c",
    "shim/separation.c",
    "shim/shapes.c",
];

/// What the feature `render` adds to the shim.
const RENDER_SOURCES: [&str; 2] = ["shim/render.c", "shim/gl_context.c"];

fn main() {
    println!("cargo::rerun-if-env-changed=MUJOCO_DIR");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=shim");
    if env::var_os("CARGO_FEATURE_MUJOCO").is_none() {
        return;
    }
    match find_mujoco() {
        Ok(installation) => compile(&installation),
        Err(missing) => {
            // Cargo shows this as the error, and stops.
            println!(
                "cargo::error={missing}. Either install Debian's library (apt-get update && \
                 apt-get install -y libmujoco-dev), or set MUJOCO_DIR to an installation of \
                 MuJoCo 2.2 or later: a directory with include/mujoco/mujoco.h, and libmujoco.so \
                 in it or in its lib (the folder `mujoco` of the PyPI wheel is one)."
            );
        }
    }
}

struct Installation {
    include: PathBuf,
    library: PathBuf,
}

fn find_mujoco() -> Result<Installation, String> {
    match env::var_os("MUJOCO_DIR") {
        Some(dir) => find_in(Path::new(&dir)),
        None => find_in_system(),
    }
}

fn find_in(dir: &Path) -> Result<Installation, String> {
    let include = dir.join("include");
    if !has_header(&include) {
        return Err(format!(
            "MUJOCO_DIR names {}, which has no include/mujoco/mujoco.h",
            dir.display()
        ));
    }
    let library = [dir.to_path_buf(), dir.join("lib")]
        .iter()
        .find_map(|folder| library_in(folder))
        .ok_or_else(|| format!("MUJOCO_DIR names {}, which has no libmujoco.so", dir.display()))?;
    Ok(Installation { include, library })
}

fn find_in_system() -> Result<Installation, String> {
    let include = SYSTEM_PREFIXES
        .iter()
        .map(PathBuf::from)
        .find(|folder| has_header(folder))
        .ok_or("MuJoCo's headers were not found")?;
    // The compiler knows the system's library folders, and answers a bare name if it finds none.
    let output = cc::Build::new()
        .get_compiler()
        .to_command()
        .arg("-print-file-name=libmujoco.so")
        .output()
        .or_else(|_| Command::new("cc").arg("-print-file-name=libmujoco.so").output())
        .map_err(|error| format!("the C compiler did not start ({error})"))?;
    let answer = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    let library =
        fs::canonicalize(&answer).map_err(|_| "MuJoCo's library libmujoco.so was not found")?;
    Ok(Installation { include, library })
}

fn has_header(include: &Path) -> bool {
    include.join("mujoco/mujoco.h").is_file()
}

/// `libmujoco.so`, or else the newest `libmujoco.so.*`: wheels carry only the latter.
fn library_in(folder: &Path) -> Option<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            path.file_name()
                .and_then(|name| name.to_str())
                .is_some_and(|name| name.starts_with("libmujoco.so") || name == "libmujoco.dylib")
        })
        .collect();
    found.sort();
    let unversioned = found.iter().find(|path| path.extension().is_some_and(|end| end == "so"));
    fs::canonicalize(unversioned.or(found.last())?).ok()
}

fn compile(installation: &Installation) {
    let header = installation.include.join("mujoco/mujoco.h");
    println!("cargo::rerun-if-changed={}", header.display());
    println!("cargo::rerun-if-changed={}", installation.library.display());
    let render = env::var_os("CARGO_FEATURE_RENDER").is_some();
    cc::Build::new()
        .files(SOURCES)
        .files(RENDER_SOURCES.iter().filter(|_| render))
        .include(&installation.include)
        .std("gnu11")
        .warnings(true)
        .extra_warnings(true)
        .opt_level(3) // the filter is in the hot path of debug builds, too
        .compile("fetch_shim");
    if env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        println!("cargo::rustc-link-lib=dl");
    }
    println!("cargo::rustc-env=FETCH_SIM_LIBMUJOCO={}", installation.library.display());
}
