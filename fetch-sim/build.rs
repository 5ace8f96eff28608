//! Finds MuJoCo and compiles the C shim against its headers.
//!
//! The library itself is loaded when it is first used, so that a program that depends on this
//! crate needs no linker flags, and a library that does not fit its headers is an error and not a
//! crash.

mod find_mujoco;

use std::{env, path::Path};

/// The shim.
const SOURCES: [&str; 6] = ["library", "model", "data", "contact_filter", "separation", "shapes"];

/// What the feature `render` adds to the shim.
const RENDER_SOURCES: [&str; 2] = ["render", "gl_context"];

fn main() {
    println!("cargo::rerun-if-env-changed=MUJOCO_DIR");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=find_mujoco.rs");
    println!("cargo::rerun-if-changed=shim");
    if env::var_os("CARGO_FEATURE_MUJOCO").is_none() {
        return;
    }
    let compiler = || cc::Build::new().get_compiler().to_command();
    match find_mujoco::find_mujoco(compiler) {
        Ok((include, library)) => compile(&include, &library),
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

fn compile(include: &Path, library: &Path) {
    let header = include.join("mujoco/mujoco.h");
    println!("cargo::rerun-if-changed={}", header.display());
    println!("cargo::rerun-if-changed={}", library.display());
    let render = env::var_os("CARGO_FEATURE_RENDER").map(|_| RENDER_SOURCES);
    let sources = SOURCES.into_iter().chain(render.into_iter().flatten());
    cc::Build::new()
        .files(sources.map(|name| format!("shim/{name}.c")))
        .include(include)
        .std("gnu11")
        .warnings(true)
        .extra_warnings(true)
        .opt_level(3) // the filter is in the hot path of debug builds, too
        .compile("fetch_shim");
    if env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        println!("cargo::rustc-link-lib=dl");
    }
    println!("cargo::rustc-env=FETCH_SIM_LIBMUJOCO={}", library.display());
}
