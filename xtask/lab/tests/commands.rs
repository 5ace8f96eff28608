//! The commands as a developer runs them: exit codes, output and files.

use std::{fs, path::Path, process::Command};

use serde_json::Value;
use testing::{
    Result,
    program::{errors_of, output_of, read_json},
};

/// Returns a command of the program, whose arguments are separated by spaces.
fn lab(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lab"));
    command.args(arguments.split_whitespace()).current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

const RECORDINGS: &str = "parity --fixtures tests/recordings/mujoco-2.2.2 --model";

#[test]
fn recordings_of_the_real_environment_are_reproduced() -> Result {
    let text = output_of(lab(RECORDINGS).arg("builtin"))?;
    assert!(text.contains("reach-random"), "{text}");
    Ok(())
}

#[test]
fn recordings_are_reproduced_to_the_last_bit_where_the_reference_model_is() -> Result {
    if fetch_sim::reference_folder().is_some_and(|folder| folder.is_dir()) {
        output_of(lab(RECORDINGS).arg("reference"))?;
    } else {
        let is_ci = std::env::var_os("CI").is_some();
        assert!(!is_ci, "CI must have the reference's model: cargo xtask assets");
    }
    Ok(())
}

#[test]
fn damaged_and_foreign_recordings_are_rejected() -> Result {
    let folder = tempfile::tempdir()?;
    let replay = |folder: &Path| lab("parity --fixtures").arg(folder).output();
    let whole = fs::read(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/recordings/mujoco-2.2.2/reach-still.npz"),
    )?;
    let mut flipped = whole.clone();
    flipped[whole.len() / 3] ^= 0xff;
    for bytes in [b"", &b"no archive"[..], &whole[..whole.len() / 2], &flipped] {
        fs::write(folder.path().join("damaged.npz"), bytes)?;
        let output = replay(folder.path())?;
        assert_eq!(output.status.code(), Some(1));
        let errors = errors_of(&output);
        assert!(errors.contains("damaged.npz is not a recording"), "{errors}");
    }
    assert_eq!(replay(tempfile::tempdir()?.path())?.status.code(), Some(1));
    Ok(())
}

/// Returns the names of a benchmark's figures, which must all be positive.
fn figures_in(path: &Path) -> Result<Vec<String>> {
    let output = read_json(path)?;
    let results = output["results"].as_array().ok_or("no list")?;
    let is_positive = |value: &Value| value.as_f64().is_some_and(|v| v > 0.0);
    assert!(results.iter().all(|result| is_positive(&result["value"])), "{results:?}");
    Ok(results.iter().filter_map(|result| Some(result["name"].as_str()?.into())).collect())
}

#[test]
fn benchmarks_write_every_figure() -> Result {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("bench.json");
    let figures = |arguments: &str| -> Result<Vec<String>> {
        output_of(lab(&format!("bench {arguments} --json")).arg(&path))?;
        figures_in(&path)
    };
    let short = "--task reach --model builtin --seconds 0 --num-envs 2 --footprint-envs 4";
    let names = figures(&format!("env {short}"))?;
    for name in [
        "single",
        "bare-loop",
        "threads-1",
        "reset",
        "construction-4",
        "memory-further-env",
        "memory-further-varied-env",
        "ratio/single-to-bare-loop",
        "ratio/reset-cost-to-bare",
    ] {
        assert!(names.contains(&format!("env/reach/builtin/{name}")), "{name}: {names:?}");
    }
    let names = figures("her --element f32 --transitions 5000 --seconds 0")?;
    for name in [
        "bytes-per-transition",
        "batch-256",
        "batch-4096/fastest",
        "insert-episodes",
        "ratio/batch-1024-to-bare-gather",
    ] {
        assert!(names.contains(&format!("her/f32/{name}")), "{name}: {names:?}");
    }
    let names = figures("reward --seconds 1")?;
    assert!(names.contains(&"reward/ratio/sparse-to-copy".into()), "{names:?}");
    Ok(())
}

#[test]
fn pictures_are_timed_with_opengl_and_refused_without() -> Result {
    for gl in ["egl", "disable"] {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("render.json");
        let mut command = lab("bench render --task reach --model builtin --seconds 0 --json");
        command.arg(&path).env("MUJOCO_GL", gl);
        let output = command.output()?;
        if errors_of(&output).contains("libegl1") {
            assert_eq!(output.status.code(), Some(1));
            let may_lack = gl == "disable" || std::env::var_os("CI").is_none();
            assert!(may_lack, "CI must install OpenGL");
            continue;
        }
        assert_eq!(output.status.code(), Some(0), "{}", errors_of(&output));
        assert_ne!(gl, "disable");
        let names = figures_in(&path)?;
        for name in [
            "480x480-samples-4",
            "84x84-samples-0",
            "sky-480x480-samples-4",
            "ratio/480x480-samples-4-to-sky-480x480-samples-4",
        ] {
            assert!(names.contains(&format!("render/reach/builtin/{name}")), "{name}: {names:?}");
        }
    }
    Ok(())
}

#[test]
fn wrong_usage_is_exit_code_2() -> Result {
    for arguments in [
        "bench",
        "parity",
        "parity live --episodes 0",
        "bench env --task grasp",
        "bench env --seconds -1",
        "bench render --seconds -1",
        "bench her --element f16",
        "bench her --transitions 0",
        "parity hindsight --rows 10",
        "parity --fixtures tests/recordings/mujoco-2.2.2 live",
        "soak --steps 0",
    ] {
        assert_eq!(lab(arguments).output()?.status.code(), Some(2), "{arguments}");
    }
    Ok(())
}
