//! Which MuJoCo is in use, where it comes from, and whether another would be faster.

use std::{path::Path, time::SystemTime};

use fetch_install::{NONE, mujoco_dir};
use fetch_sim::{
    MujocoVersion, Remembered, SimError, brings_library, library_path, remembered_mujoco,
};

/// Returns the version in use, its library, and where that comes from.
///
/// # Errors
/// Those of loading MuJoCo.
pub fn in_use() -> Result<String, SimError> {
    let (version, path) = (MujocoVersion::of_library()?, library_path()?);
    let origin = match remembered_mujoco() {
        _ if brings_library() => " (the program brings it)".into(),
        _ if is_named() => " (MUJOCO_DIR names it)".into(),
        Ok(Some(it)) if is_in(&path, &it) => format!(
            " (remembered, asked for {} ago; `fetch-env mujoco system` returns to the system's)",
            ago(it.since, SystemTime::now())
        ),
        _ if is_of_system(&path) => " (the system's)".into(),
        _ => String::new(),
    };
    Ok(format!("MuJoCo {version}, headers and library; {}{origin}", path.display()))
}

/// Returns what the user should know about the MuJoCo in use: that another one is remembered, or
/// that the system's is slow. Debian compiles its 2.2.2 so that it steps Push at 0.62 of the speed
/// of the official 3.6.0.
///
/// # Errors
/// As [`in_use`].
pub fn advice() -> Result<Option<String>, SimError> {
    let version = MujocoVersion::of_library()?.to_string();
    if brings_library() {
        return Ok(None);
    }
    let is_slow = version.starts_with("2.2.") && is_of_system(&library_path()?);
    Ok(match remembered_mujoco() {
        _ if is_named() => None,
        Err(unusable) => Some(unusable.to_string()),
        Ok(Some(it)) if it.version != version => Some(format!(
            "MuJoCo {} is remembered, but this program was built with {version}: build it again",
            it.version
        )),
        Ok(_) => is_slow.then(|| {
            format!(
                "`fetch-env mujoco 3.6.0` makes everything about 1.6 times as fast as on the \
                 system's MuJoCo {version}"
            )
        }),
    })
}

/// Whether `MUJOCO_DIR` names a MuJoCo, which then is the one in use.
fn is_named() -> bool {
    mujoco_dir().is_some_and(|dir| dir.as_os_str() != NONE)
}

/// Whether a library is that of the remembered MuJoCo.
fn is_in(library: &Path, remembered: &Remembered) -> bool {
    remembered.folder.canonicalize().is_ok_and(|folder| library.starts_with(folder))
}

fn is_of_system(library: &Path) -> bool {
    library.starts_with("/usr")
}

/// Returns the time between two times, in words.
fn ago(since: SystemTime, now: SystemTime) -> String {
    let seconds = now.duration_since(since).unwrap_or_default().as_secs();
    match seconds {
        0..3_600 => format!("{} minutes", seconds / 60),
        3_600..172_800 => format!("{} hours", seconds / 3_600),
        _ => format!("{} days", seconds / 86_400),
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::ago;

    #[test]
    fn times_are_told_in_a_unit_that_suits_them() {
        let since = SystemTime::UNIX_EPOCH;
        for (seconds, words) in
            [(0, "0 minutes"), (3_599, "59 minutes"), (7_200, "2 hours"), (864_000, "10 days")]
        {
            assert_eq!(ago(since, since + Duration::from_secs(seconds)), words);
        }
        assert_eq!(ago(since + Duration::from_secs(9), since), "0 minutes", "clocks are set back");
    }
}
