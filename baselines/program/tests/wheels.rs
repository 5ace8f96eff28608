//! `assets` and `mujoco` as a user runs them, with wheels that are whole, damaged and foreign.

mod program;

use std::{
    fs::{self, File},
    io::{Cursor, Write},
    path::Path,
};

use base64::prelude::{BASE64_URL_SAFE_NO_PAD, Engine};
use program::fetch;
use testing::{
    Result,
    program::{errors_of, output_of},
};
use zip::{ZipWriter, write::SimpleFileOptions};

#[test]
fn a_foreign_or_damaged_wheel_leaves_the_cache_as_it_was() -> Result {
    let folder = tempfile::tempdir()?;
    let cache = folder.path().join("cache");
    fs::create_dir(&cache)?;
    fs::write(cache.join("kept"), "as it was")?;
    let wheel = folder.path().join("foreign.whl");
    // An archive of something else, and then a file that is not an archive.
    let mut foreign = ZipWriter::new(Cursor::new(Vec::new()));
    foreign.start_file("foreign.txt", SimpleFileOptions::default())?;
    for contents in [foreign.finish()?.into_inner(), b"no archive".to_vec()] {
        fs::write(&wheel, contents)?;
        let output = fetch("assets --from").arg(&wheel).env("FETCH_ASSETS_DIR", &cache).output()?;
        assert_eq!(output.status.code(), Some(1));
        assert!(errors_of(&output).contains("foreign.whl"), "{}", errors_of(&output));
        assert_eq!(fs::read_to_string(cache.join("kept"))?, "as it was");
        assert_eq!(fs::read_dir(folder.path())?.count(), 2, "nothing left over");
    }
    Ok(())
}

/// Writes a wheel of MuJoCo 9.8.7 whose RECORD lists these contents of the library.
fn write_wheel(path: &Path, library: &str, recorded: &str) -> Result {
    let digest =
        |text: &str| BASE64_URL_SAFE_NO_PAD.encode(hmac_sha256::Hash::hash(text.as_bytes()));
    let record = format!(
        "mujoco/include/mujoco/mujoco.h,sha256={},6\nmujoco/libmujoco.so.9.8.7,sha256={},7\n\
         mujoco/not_wanted.py,sha256={},0\nmujoco_core-9.8.7.dist-info/RECORD,,\n",
        digest("header"),
        digest(recorded),
        digest("")
    );
    let mut wheel = ZipWriter::new(File::create(path)?);
    for (name, text) in [
        ("mujoco/include/mujoco/mujoco.h", "header"),
        ("mujoco/libmujoco.so.9.8.7", library),
        ("mujoco/not_wanted.py", ""),
        ("mujoco_core-9.8.7.dist-info/RECORD", &record),
    ] {
        wheel.start_file(name, SimpleFileOptions::default())?;
        wheel.write_all(text.as_bytes())?;
    }
    wheel.finish()?;
    Ok(())
}

#[test]
fn a_wheel_of_mujoco_is_unpacked_whole_or_not_at_all() -> Result {
    let folder = tempfile::tempdir()?;
    let wheel = folder.path().join("mujoco_core-9.8.7.whl");
    let unpack = |version: &str| {
        let mut command = fetch("mujoco --from");
        command.arg(&wheel).arg(version).env("XDG_CACHE_HOME", folder.path()).output()
    };
    write_wheel(&wheel, "tampered", "library")?;
    let output = unpack("9.8.7")?;
    assert_eq!(output.status.code(), Some(1));
    assert!(
        errors_of(&output).contains("libmujoco.so.9.8.7 has the SHA-256 "),
        "{}",
        errors_of(&output)
    );
    assert_eq!(fs::read_dir(folder.path().join("fetch-env"))?.count(), 0, "nothing left over");

    write_wheel(&wheel, "library", "library")?;
    let output = unpack("9.8.7")?;
    assert_eq!(output.status.code(), Some(0), "{}", errors_of(&output));
    // The name of the folder depends on the platform.
    let text = String::from_utf8(output.stdout)?;
    let line = text.lines().find_map(|line| line.strip_prefix("MuJoCo 9.8.7 is ready in "));
    let unpacked = Path::new(line.ok_or("no folder")?);
    assert!(unpacked.starts_with(folder.path().canonicalize()?.join("fetch-env")), "{text}");
    assert_eq!(fs::read_to_string(unpacked.join("libmujoco.so.9.8.7"))?, "library");
    assert!(!unpacked.join("not_wanted.py").exists());

    // Without Python it cannot be fetched again, and need not be as long as it is complete.
    let again = || {
        let mut command = fetch("mujoco 9.8.7");
        command.env("XDG_CACHE_HOME", folder.path()).env("PATH", folder.path()).output()
    };
    let output = again()?;
    assert_eq!(output.status.code(), Some(0), "{}", errors_of(&output));
    for removed in [Path::new("libmujoco.so.9.8.7"), Path::new("include/mujoco/mujoco.h")] {
        fs::remove_file(unpacked.join(removed))?;
        let output = again()?;
        assert_eq!(output.status.code(), Some(1), "without {}", removed.display());
        assert!(errors_of(&output).contains("python3 did not start"), "{}", errors_of(&output));
        assert_eq!(unpack("9.8.7")?.status.code(), Some(0));
    }

    // It is remembered until it is forgotten; what is for another platform is not.
    let mujoco = |arguments: &str| {
        output_of(fetch("mujoco").args(arguments.split(' ')).env("XDG_CACHE_HOME", folder.path()))
    };
    let doctor = || fetch("doctor").env("XDG_CACHE_HOME", folder.path()).output();
    let text = String::from_utf8(doctor()?.stdout)?;
    assert!(text.contains("MuJoCo 9.8.7 is remembered, but this program was built with"), "{text}");
    fs::remove_file(unpacked.join("libmujoco.so.9.8.7"))?;
    let output = doctor()?;
    let text = String::from_utf8(output.stdout)?;
    assert_eq!(output.status.code(), Some(0), "it falls back: {text}");
    assert!(text.contains("MuJoCo 9.8.7 is remembered, but "), "{text}");
    assert!(mujoco("system")?.starts_with("forgotten: "));
    assert!(mujoco("system")?.starts_with("nothing was remembered: "));
    let text = String::from_utf8(doctor()?.stdout)?;
    assert!(!text.contains("remembered"), "{text}");

    let output = unpack("9.8.8")?;
    assert_eq!(output.status.code(), Some(1), "a wheel of another version");
    assert!(errors_of(&output).contains("mujoco_core-9.8.7.whl"), "{}", errors_of(&output));
    Ok(())
}
