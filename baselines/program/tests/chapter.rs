//! The chapter's commands as a user runs them: exit codes, output and files.

mod program;

use std::{fs, io};

use program::fetch;
use serde_json::json;
use testing::{
    Result,
    program::{errors_of, output_of, read_json},
};

#[test]
fn verify_passes_every_check_of_an_environment() -> Result {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("verify.json");
    let text = output_of(fetch("verify --env-id FetchReach-v4 --json").arg(&path))?;
    assert!(text.contains("0 failed") && !text.contains("FAIL"), "{text}");
    let output = read_json(&path)?;
    for key in ["versions", "machine", "settings", "results"] {
        assert!(output.get(key).is_some(), "{key}");
    }
    let results = output["results"].as_array().ok_or("no list")?;
    assert!(results.iter().any(|result| {
        result["name"] == "verify/FetchReach-v4/reward/threshold"
            && result["value"] == 0.05
            && result["unit"] == "m"
    }));
    Ok(())
}

#[test]
fn bridge_prints_the_chapters_proof() -> Result {
    let text = output_of(&mut fetch("bridge"))?;
    for line in [
        "Env: FetchReachDense-v4, seed=42, steps=100",
        "Step reward checks:    100 steps, mismatches=0",
        "Relabel reward checks: 500 checks, mismatches=0",
        "[MATCH] All rewards match within atol=1e-10",
        "[BRIDGE OK] Bridging proof passed",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    Ok(())
}

#[test]
fn all_writes_the_chapters_files_and_two_processes_agree() -> Result {
    let folders = [tempfile::tempdir()?, tempfile::tempdir()?];
    for folder in &folders {
        let text = output_of(fetch("all --seed 0").current_dir(folder.path()))?;
        assert!(
            text.contains("OK: reward checks passed (atol=1e-6, n_steps=500, n_random_goals=3)")
        );
    }
    let path = |run: usize, name: &str| folders[run].path().join("results").join(name);
    for name in ["ch01_env_describe.json", "ch01_random_metrics.json"] {
        assert_eq!(fs::read(path(0, name))?, fs::read(path(1, name))?, "same seed, same bits");
    }
    let description = read_json(&path(0, "ch01_env_describe.json"))?;
    let shape = |part: &str| description["observation_space"][part]["shape"].clone();
    assert_eq!(shape("observation"), json!([10]));
    assert_eq!(shape("achieved_goal"), json!([3]));
    assert_eq!(shape("desired_goal"), json!([3]));
    assert_eq!(description["action_space"]["shape"], json!([4]));
    assert_eq!(description["action_space"]["low"], json!([-1.0, -1.0, -1.0, -1.0]));
    assert_eq!(description["action_space"]["high"], json!([1.0, 1.0, 1.0, 1.0]));
    let metrics = read_json(&path(0, "ch01_random_metrics.json"))?;
    assert_eq!(metrics["ep_len_mean"], 50.0);
    let figure = |name: &str| metrics[name].as_f64().unwrap_or(f64::NAN);
    assert!((0.0..=0.1).contains(&figure("success_rate")));
    assert!((-25.0..-5.0).contains(&figure("return_mean")));
    assert!(figure("final_distance_mean") > 0.0);
    Ok(())
}

#[test]
fn every_exercise_has_its_answer() -> Result {
    for (number, answer) in [
        (1, "Same keys and shapes: true. Goals differ: true."),
        (2, "(c) It switches at 0.05 m"),
        (3, "achieved_goal is the object's position: true"),
        (4, "0.05 m"),
    ] {
        let text = output_of(&mut fetch(&format!("exercise {number}")))?;
        assert!(text.contains(answer), "{text}");
    }
    Ok(())
}

#[test]
fn doctor_finds_nothing_wrong() -> Result {
    let text = output_of(&mut fetch("doctor"))?;
    assert!(text.contains("ok") && !text.contains("FAIL"), "{text}");
    Ok(())
}

/// Also where the program was built with another MuJoCo.
#[test]
fn doctor_notices_a_mujoco_dir_that_names_nothing() -> Result {
    let output = fetch("doctor").env("MUJOCO_DIR", "/nonexistent").output()?;
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stdout)?;
    assert!(
        text.starts_with("FAIL  MuJoCo is missing, or not the one used for the build\n"),
        "{text}"
    );
    assert!(text.contains("MUJOCO_DIR is /nonexistent, "), "{text}");
    Ok(())
}

/// As in other well-known tools: a reader may have seen enough, and a disk may be full.
#[test]
fn a_closed_pipe_ends_a_command_quietly_and_a_full_disk_with_an_error() -> Result {
    for arguments in ["bridge", "exercise 1", "exercise 3"] {
        let (reader, writer) = io::pipe()?;
        drop(reader);
        let output = fetch(arguments).stdout(writer).output()?;
        assert_eq!((output.status.code(), errors_of(&output).as_str()), (Some(0), ""));
        let output = fetch(arguments).stdout(fs::File::create("/dev/full")?).output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(errors.starts_with("error: cannot write to standard output: No space"), "{errors}");
    }
    let full = || fs::File::create("/dev/full");
    let output = fetch("bridge").stdout(full()?).stderr(full()?).output()?;
    assert_eq!(output.status.code(), Some(1));
    Ok(())
}

#[test]
fn wrong_usage_is_exit_code_2() -> Result {
    for arguments in [
        "verify --env-id FetchPsh-v4",
        "verify here",
        "exercise",
        "exercise 5",
        "exercise 1 2",
        "",
        "nothing",
        "help nothing",
        "bridge --seed -1",
        "random-episodes --episodes 0",
        "describe --json here",
        "all --seed",
        "doctor --env-id FetchPush-v4",
        "reward-check --seed=much",
        "assets here",
        "mujoco",
        "mujoco 3.6",
        "mujoco 3.6.0 3.7.0",
        "mujoco --for nothing 3.6.0",
        "mujoco --for aarch64-linux --from wheel.whl 3.6.0",
    ] {
        let output = fetch(arguments).output()?;
        assert_eq!(output.status.code(), Some(2), "{arguments}: {}", errors_of(&output));
    }
    let errors = errors_of(&fetch("verify --env-id FetchPsh-v4").output()?);
    assert!(errors.contains("FetchPush-v4"), "{errors}");
    Ok(())
}
