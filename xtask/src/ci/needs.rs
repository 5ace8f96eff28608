//! The tools that steps need beyond the README's first command: how to find and how to install
//! them.

use std::{
    path::Path,
    process::{Command, Stdio},
};

use fetch_install::Places;

use crate::c_compiler;

/// A tool or library of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// MuJoCo's headers: those that a build finds.
    Mujoco,
    Rustfmt,
    Clippy,
    Git,
    CPlusPlus,
    Valgrind,
    Python,
    Mpi,
    Hosts,
    OpenGl,
    Chromium,
    Aarch64,
    Wine,
}

/// What installs a tool.
#[derive(Clone, Copy, Debug)]
enum Source {
    /// Debian's packages.
    Packages(&'static [&'static str]),
    /// A component of a toolchain.
    Component(&'static str),
}

impl Need {
    pub const ALL: [Self; 13] = [
        Self::Mujoco,
        Self::Rustfmt,
        Self::Clippy,
        Self::Git,
        Self::CPlusPlus,
        Self::Valgrind,
        Self::Python,
        Self::Mpi,
        Self::Hosts,
        Self::OpenGl,
        Self::Chromium,
        Self::Aarch64,
        Self::Wine,
    ];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Mujoco => "MuJoCo",
            Self::Rustfmt => "rustfmt",
            Self::Clippy => "Clippy",
            Self::Git => "Git",
            Self::CPlusPlus => "a C++ compiler",
            Self::Valgrind => "Valgrind",
            Self::Python => "Python with pip and venv",
            Self::Mpi => "Open MPI and Clang's library",
            Self::Hosts => "network namespaces and SSH",
            Self::OpenGl => "OpenGL through EGL and OSMesa",
            Self::Chromium => "Chromium",
            Self::Aarch64 => "a compiler and an emulator for aarch64",
            Self::Wine => "a compiler for Windows, and Wine",
        }
    }

    const fn source(self) -> Source {
        match self {
            Self::Mujoco => Source::Packages(&["libmujoco-dev"]),
            Self::Rustfmt => Source::Component("rustfmt"),
            Self::Clippy => Source::Component("clippy"),
            Self::Git => Source::Packages(&["git"]),
            Self::CPlusPlus => Source::Packages(&["g++"]),
            // It reads the C library's debugging symbols.
            Self::Valgrind => Source::Packages(&["valgrind", "libc6-dbg"]),
            Self::Python => Source::Packages(&["python3-pip", "python3-venv"]),
            Self::Mpi => Source::Packages(&["libopenmpi-dev", "openmpi-bin", "libclang-dev"]),
            Self::Hosts => Source::Packages(&["iproute2", "openssh-server", "openssh-client"]),
            Self::OpenGl => Source::Packages(&["libegl1", "libgl1-mesa-dri", "libosmesa6"]),
            Self::Chromium => Source::Packages(&["chromium"]),
            Self::Aarch64 => {
                Source::Packages(&["gcc-aarch64-linux-gnu", "libc6-dev-arm64-cross", "qemu-user"])
            }
            Self::Wine => Source::Packages(&["gcc-mingw-w64-x86-64-win32", "wine", "wine64"]),
        }
    }

    pub fn is_there(self) -> bool {
        match self {
            Self::Mujoco => {
                Places::of_machine().find(c_compiler).is_ok_and(|found| found.is_some())
            }
            Self::Rustfmt => runs(env!("CARGO"), &["fmt", "--version"]),
            Self::Clippy => runs(env!("CARGO"), &["clippy", "--version"]),
            Self::Git => runs("git", &["--version"]),
            Self::CPlusPlus => runs("c++", &["--version"]),
            Self::Valgrind => runs("valgrind", &["--version"]),
            Self::Python => {
                runs("python3", &["-m", "pip", "--version"])
                    && runs("python3", &["-c", "import ensurepip, venv"])
            }
            Self::Mpi => {
                runs("mpirun", &["--version"])
                    && runs("mpicc", &["-show"])
                    && has_library("libclang")
            }
            Self::Hosts => {
                runs("ip", &["-V"]) && runs("ssh", &["-V"]) && Path::new("/usr/sbin/sshd").exists()
            }
            Self::OpenGl => has_library("libEGL.so.1") && has_library("libOSMesa.so"),
            Self::Chromium => runs("chromium", &["--version"]),
            Self::Aarch64 => {
                runs("aarch64-linux-gnu-gcc", &["--version"])
                    && runs("qemu-aarch64", &["--version"])
            }
            Self::Wine => {
                runs("x86_64-w64-mingw32-gcc", &["--version"]) && runs("wine", &["--version"])
            }
        }
    }
}

/// Whether a program succeeds.
fn runs(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// Whether the dynamic linker knows a library whose name begins with `name`.
fn has_library(name: &str) -> bool {
    // Few users have it in their path.
    let list = Command::new("/sbin/ldconfig").arg("-p").output();
    list.is_ok_and(|list| {
        let text = String::from_utf8_lossy(&list.stdout);
        text.lines().any(|line| line.trim_start().starts_with(name))
    })
}

/// Returns the commands that install what is missing, in the order in which to run them.
pub fn commands_for(missing: &[Need]) -> Vec<String> {
    let (mut packages, mut components) = (Vec::new(), Vec::new());
    for need in missing {
        match need.source() {
            Source::Packages(names) => packages.extend(names),
            Source::Component(name) => components.push(name),
        }
    }
    let lines = [
        ("apt-get update && apt-get install -y --no-install-recommends", packages),
        ("rustup component add", components),
    ];
    let needed = lines.into_iter().filter(|(_, names)| !names.is_empty());
    needed.map(|(command, names)| format!("{command} {}", names.join(" "))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_brought_by_one_line_of_each_kind() {
        let lines = commands_for(&Need::ALL);
        assert_eq!(lines.len(), 2, "{lines:?}");
        assert!(lines[0].starts_with("apt-get update && apt-get install -y "), "{lines:?}");
        assert_eq!(lines[1], "rustup component add rustfmt clippy");
        for package in ["libmujoco-dev", "g++", "libopenmpi-dev", "chromium", "libosmesa6"] {
            assert!(lines[0].split(' ').any(|word| word == package), "{package}");
        }
        assert_eq!(commands_for(&[Need::Clippy]), ["rustup component add clippy"]);
        assert!(commands_for(&[]).is_empty());
    }
}
