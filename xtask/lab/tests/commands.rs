//! The commands as a user runs them: exit codes, output and files.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

fn lab(arguments: &str) -> Output {
    lab_in(Path::new(env!("CARGO_MANIFEST_DIR")), arguments)
}

fn lab_in(folder: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lab"))
        .args(arguments.split(' '))
        .current_dir(folder)
        .output()
        .expect("the command starts")
}

/// Standard output of a command that must succeed.
fn output_of(arguments: &str) -> String {
    text_of(&lab(arguments), arguments)
}

fn text_of(output: &Output, arguments: &str) -> String {
    let text = String::from_utf8(output.stdout.clone()).expect("UTF-8");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments}\n{text}\n{errors}");
    text
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(path).expect("a file")).expect("JSON")
}

#[test]
fn verify_passes_every_check_of_an_environment() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("verify.json");
    let text = output_of(&format!("verify --env-id FetchReach-v4 --json {}", path.display()));
    assert!(text.contains("0 failed") && !text.contains("FAIL"), "{text}");
    let report = json(&path);
    for key in ["versions", "machine", "settings", "results"] {
        assert!(report.get(key).is_some(), "{key}");
    }
    let results = report["results"].as_array().expect("a list");
    assert!(results.iter().any(|result| {
        result["name"] == "verify/FetchReach-v4/reward/threshold"
            && result["value"] == 0.05
            && result["unit"] == "m"
    }));
}

#[test]
fn bridge_prints_the_chapters_proof() {
    let text = output_of("bridge");
    for line in [
        "Env: FetchReachDense-v4, seed=42, steps=100",
        "Step reward checks:    100 steps, mismatches=0",
        "Relabel reward checks: 500 checks, mismatches=0",
        "[MATCH] All rewards match within atol=1e-10",
        "[BRIDGE OK] Bridging proof passed",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
}

#[test]
fn all_writes_the_chapters_files_and_two_processes_agree() {
    let run = || {
        let folder = tempfile::tempdir().expect("a folder");
        let output = lab_in(folder.path(), "all --seed 0");
        let text = text_of(&output, "all");
        assert!(
            text.contains("OK: reward checks passed (atol=1e-6, n_steps=500, n_random_goals=3)")
        );
        let read = |name: &str| fs::read(folder.path().join("results").join(name)).expect("a file");
        let description = json(&folder.path().join("results/ch01_env_describe.json"));
        let metrics = json(&folder.path().join("results/ch01_random_metrics.json"));
        ((description, metrics), (read("ch01_env_describe.json"), read("ch01_random_metrics.json")))
    };
    let ((description, metrics), bytes) = run();
    assert_eq!(bytes, run().1, "same seed, same bits");

    let shape = |part: &str| description["observation_space"][part]["shape"].clone();
    assert_eq!(shape("observation"), serde_json::json!([10]));
    assert_eq!(shape("achieved_goal"), serde_json::json!([3]));
    assert_eq!(shape("desired_goal"), serde_json::json!([3]));
    assert_eq!(description["action_space"]["shape"], serde_json::json!([4]));
    assert_eq!(description["action_space"]["low"], serde_json::json!([-1.0, -1.0, -1.0, -1.0]));
    assert_eq!(description["action_space"]["high"], serde_json::json!([1.0, 1.0, 1.0, 1.0]));
    assert_eq!(metrics["ep_len_mean"], 50.0);
    let figure = |name: &str| metrics[name].as_f64().expect(name);
    assert!((0.0..=0.1).contains(&figure("success_rate")));
    assert!((-25.0..-5.0).contains(&figure("return_mean")));
    assert!(figure("final_distance_mean") > 0.0);
}

#[test]
fn every_exercise_has_its_answer() {
    for (number, answer) in [
        (1, "Same keys and shapes: true. Goals differ: true."),
        (2, "(c) It switches at 0.05 m"),
        (3, "achieved_goal is the object's position: true"),
        (4, "0.05 m"),
    ] {
        let text = output_of(&format!("exercise {number}"));
        assert!(text.contains(answer), "{text}");
    }
}

#[test]
fn doctor_finds_nothing_wrong() {
    let text = output_of("doctor");
    assert!(text.contains("ok") && !text.contains("FAIL"), "{text}");
}

#[test]
fn figures_are_written_with_opengl_and_without() {
    for gl in ["egl", "disable"] {
        let folder = tempfile::tempdir().expect("a folder");
        let output = Command::new(env!("CARGO_BIN_EXE_lab"))
            .args(["figures", "--out"])
            .arg(folder.path())
            .env("MUJOCO_GL", gl)
            .output()
            .expect("the command starts");
        text_of(&output, "figures");
        for name in ["reach", "push", "pick_and_place", "slide", "observation", "rewards"] {
            let read = |ending: &str| {
                let path = folder.path().join(format!("{name}.{ending}"));
                fs::read(path).expect("a file")
            };
            assert!(read("png").starts_with(b"\x89PNG"), "{name}");
            let svg = String::from_utf8(read("svg")).expect("text");
            assert!(svg.ends_with("</svg>\n") || svg.ends_with("</svg>"), "{name}");
            // A scene's picture, or what to install.
            let (drawn, told) = (svg.contains("data:image/png"), svg.contains("libegl1"));
            assert_eq!(drawn || told, !["observation", "rewards"].contains(&name), "{name}");
            assert!(!(drawn && gl == "disable"), "{name}");
        }
    }
}

#[test]
fn recordings_of_the_real_environment_are_reproduced() {
    let text = output_of("parity --fixtures tests/recordings/mujoco-2.2.2 --model builtin");
    assert!(text.contains("reach-random"), "{text}");
}

/// CI fetches the reference's model and runs this comparison as a command of its own.
#[test]
fn recordings_are_reproduced_to_the_last_bit_where_the_reference_model_is() {
    if fetch_sim::reference_folder().is_ok_and(|folder| folder.is_dir()) {
        output_of("parity --fixtures tests/recordings/mujoco-2.2.2 --model reference");
    }
}

#[test]
fn damaged_and_foreign_recordings_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let refused = |bytes: &[u8]| {
        fs::write(folder.path().join("damaged.npz"), bytes).expect("a file");
        let output = lab(&format!("parity --fixtures {}", folder.path().display()));
        assert_eq!(output.status.code(), Some(1));
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(error.contains("damaged.npz is no recording"), "{error}");
    };
    let whole = fs::read("tests/recordings/mujoco-2.2.2/reach-still.npz").expect("a recording");
    refused(b"");
    refused(b"no archive");
    refused(&whole[..whole.len() / 2]);
    let mut flipped = whole.clone();
    flipped[whole.len() / 3] ^= 0xff;
    refused(&flipped);

    let empty = tempfile::tempdir().expect("a folder");
    let output = lab(&format!("parity --fixtures {}", empty.path().display()));
    assert_eq!(output.status.code(), Some(1));
}

/// The names of a benchmark's figures, all of which must be positive.
fn figures_in(path: &Path) -> Vec<String> {
    let report = json(path);
    let results = report["results"].as_array().expect("a list");
    let is_positive = |value: &serde_json::Value| value.as_f64().is_some_and(|v| v > 0.0);
    assert!(results.iter().all(|result| is_positive(&result["value"])), "{results:?}");
    results.iter().map(|result| result["name"].as_str().expect("a name").into()).collect()
}

#[test]
fn benchmarks_write_every_figure() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bench.json");
    let figures = |arguments: &str| -> Vec<String> {
        output_of(&format!("bench {arguments} --json {}", path.display()));
        figures_in(&path)
    };
    let short = "--task reach --model builtin --seconds 0 --num-envs 2 --footprint-envs 4";
    let names = figures(&format!("env {short}"));
    for name in [
        "single",
        "bare-loop",
        "threads-1",
        "reset",
        "construction-4",
        "memory-further-env",
        "ratio/single-to-bare-loop",
        "ratio/reset-cost-to-bare",
    ] {
        assert!(names.contains(&format!("env/reach/builtin/{name}")), "{name}: {names:?}");
    }
    let names = figures("her --element f32 --transitions 5000 --seconds 0");
    for name in [
        "bytes-per-transition",
        "batch-256",
        "batch-4096/fastest",
        "insert-episodes",
        "ratio/batch-1024-to-bare-gather",
    ] {
        assert!(names.contains(&format!("her/f32/{name}")), "{name}: {names:?}");
    }
    let names = figures("reward --seconds 1");
    assert!(names.contains(&"reward/ratio/sparse-to-copy".into()), "{names:?}");
}

#[test]
fn pictures_are_timed_with_opengl_and_refused_without() {
    for gl in ["egl", "disable"] {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("render.json");
        let output = Command::new(env!("CARGO_BIN_EXE_lab"))
            .args("bench render --task reach --model builtin --seconds 0 --json".split(' '))
            .arg(&path)
            .env("MUJOCO_GL", gl)
            .output()
            .expect("the command starts");
        if String::from_utf8_lossy(&output.stderr).contains("libegl1") {
            assert_eq!(output.status.code(), Some(1));
            let may_lack = gl == "disable" || std::env::var_os("CI").is_none();
            assert!(may_lack, "CI must install OpenGL");
            continue;
        }
        text_of(&output, "bench render");
        assert_ne!(gl, "disable");
        let names = figures_in(&path);
        for name in [
            "480x480-samples-4",
            "84x84-samples-0",
            "sky-480x480-samples-4",
            "ratio/480x480-samples-4-to-sky-480x480-samples-4",
        ] {
            assert!(names.contains(&format!("render/reach/builtin/{name}")), "{name}: {names:?}");
        }
    }
}

#[test]
fn wrong_usage_is_exit_code_2() {
    for arguments in [
        "verify --env-id FetchPsh-v4",
        "exercise 5",
        "nothing",
        "bridge --seed -1",
        "bench",
        "bench env --task grasp",
        "bench env --seconds -1",
        "bench render --seconds -1",
        "bench her --element f16",
        "bench her --transitions 0",
        "parity --hindsight --live",
    ] {
        let output = lab(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments}");
    }
    let error = String::from_utf8_lossy(&lab("verify --env-id FetchPsh-v4").stderr).into_owned();
    assert!(error.contains("FetchPush-v4"), "{error}");
}
