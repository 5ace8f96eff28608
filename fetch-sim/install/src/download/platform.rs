//! The systems and processors for which MuJoCo has wheels.

use super::{error::DownloadError, wheel::python};

/// A system and processor.
#[derive(Debug)]
pub(super) struct Platform {
    /// Its name, made of Rust's names for both.
    pub(super) name: &'static str,
    /// Python's names for both.
    python: &'static str,
    /// The tags of its wheels.
    tags: Tags,
}

#[derive(Debug)]
enum Tags {
    /// The tags of this processor, for any version of the C library.
    Manylinux(&'static str),
    /// The newest tag, from which pip derives the others.
    One(&'static str),
}

const PLATFORMS: [Platform; 5] = [
    Platform { name: "x86_64-linux", python: "linux x86_64", tags: Tags::Manylinux("x86_64") },
    Platform { name: "aarch64-linux", python: "linux aarch64", tags: Tags::Manylinux("aarch64") },
    Platform {
        name: "aarch64-macos",
        python: "darwin arm64",
        tags: Tags::One("macosx_26_0_arm64"),
    },
    Platform {
        name: "x86_64-macos",
        python: "darwin x86_64",
        tags: Tags::One("macosx_26_0_x86_64"),
    },
    Platform { name: "x86_64-windows", python: "win32 AMD64", tags: Tags::One("win_amd64") },
];

impl Platform {
    /// Returns the platform of a name.
    ///
    /// # Errors
    /// [`DownloadError::Platform`].
    pub(super) fn of(name: &str) -> Result<&'static Self, DownloadError> {
        PLATFORMS.iter().find(|platform| platform.name == name).ok_or_else(|| {
            let known = PLATFORMS.iter().map(|platform| platform.name).collect();
            DownloadError::Platform { platform: name.into(), known }
        })
    }

    /// Returns pip's arguments that ask for wheels of this platform. There are none if Python
    /// itself is of this platform: pip then also knows which wheels this machine can use.
    pub(super) fn pip_arguments(&self) -> Vec<String> {
        let script = "import platform, sys; print(sys.platform, platform.machine())";
        let output = python().args(["-c", script]).output();
        if output.is_ok_and(|output| output.stdout.trim_ascii() == self.python.as_bytes()) {
            return Vec::new();
        }
        self.tags().into_iter().flat_map(|tag| ["--platform".into(), tag]).collect()
    }

    fn tags(&self) -> Vec<String> {
        match self.tags {
            Tags::One(tag) => vec![tag.into()],
            Tags::Manylinux(processor) => {
                let numbered =
                    (17..=40).rev().map(|glibc| format!("manylinux_2_{glibc}_{processor}"));
                numbered.chain([format!("manylinux2014_{processor}")]).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{DownloadError, PLATFORMS, Platform};
    use crate::folders::own_platform;

    #[test]
    fn the_wheels_of_another_platform_are_asked_for_by_their_tags() {
        for platform in PLATFORMS.iter().filter(|platform| platform.name != own_platform()) {
            let arguments = platform.pip_arguments();
            assert!(arguments.iter().step_by(2).all(|argument| argument == "--platform"));
            let tags: Vec<_> = arguments.iter().skip(1).step_by(2).collect();
            assert!(!tags.is_empty(), "{platform:?}");
            if platform.name.ends_with("linux") {
                assert!(tags.iter().any(|tag| tag.starts_with("manylinux_2_28_")), "{tags:?}");
            }
        }
    }

    #[test]
    fn an_unknown_platform_is_an_error_that_lists_those_with_wheels() {
        let error = Platform::of("riscv64-linux").expect_err("no wheels");
        assert!(matches!(error, DownloadError::Platform { .. }));
        assert!(error.to_string().contains("aarch64-linux, aarch64-macos"), "{error}");
    }
}
