//! `platforms`: builds and tests the crates for other systems and processors than this machine's.

mod aarch64_linux;

use lexopt::{Arg::Long, Parser, ValueExt};

/// Returns whether everything passed.
type Check = fn() -> anyhow::Result<bool>;

/// The platforms by the names that `cargo xtask mujoco --for` takes, too.
const PLATFORMS: [(&str, Check); 1] = [("aarch64-linux", aarch64_linux::check)];

/// The version of MuJoCo whose wheels are used.
const MUJOCO: &str = "3.6.0";

pub fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    let mut only = None;
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("only") => {
                only = Some(arguments.value()?.parse_with(|name| {
                    let known = PLATFORMS.into_iter().find(|(known, _)| *known == name);
                    known.ok_or_else(|| {
                        let names = PLATFORMS.map(|(name, _)| name);
                        format!("the platforms are {}", names.join(", "))
                    })
                })?);
            }
            other => return Err(other.unexpected().into()),
        }
    }
    for (name, check) in only.map_or_else(|| PLATFORMS.to_vec(), |only| vec![only]) {
        if !check()? {
            say!("platforms: {name}: failed")?;
            return Ok(false);
        }
    }
    Ok(true)
}
