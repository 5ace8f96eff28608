//! The commands as a user runs them: exit codes, output and files.

mod program;

use std::{fs, path::Path, process::Command};

use baselines::{ScriptedPolicy, buffer_config, collect};
use commands::Program;
use fetch_env::{Task, make_kinematic};
use her_relabel::HerBuffer;
use serde_json::Value;

use program::{Result, errors_of, lab, output_of, read_json};

#[test]
fn figures_are_written_with_opengl_and_without() -> Result {
    for gl in ["egl", "disable"] {
        let folder = tempfile::tempdir()?;
        output_of(lab("figures --out").arg(folder.path()).env("MUJOCO_GL", gl))?;
        for name in ["reach", "push", "pick_and_place", "slide", "observation", "rewards"] {
            let path = |ending: &str| folder.path().join(format!("{name}.{ending}"));
            assert!(fs::read(path("png"))?.starts_with(b"\x89PNG"), "{name}");
            let svg = fs::read_to_string(path("svg"))?;
            assert!(svg.ends_with("</svg>\n") || svg.ends_with("</svg>"), "{name}");
            // A picture of the scene, or the packages to install.
            let (drawn, missing) = (svg.contains("data:image/png"), svg.contains("libegl1"));
            assert_eq!(drawn || missing, !["observation", "rewards"].contains(&name), "{name}");
            assert!(!(drawn && gl == "disable"), "{name}");
        }
    }
    Ok(())
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
        "nothing",
        "bench",
        "collect --episodes 0",
        "report --episodes 0",
        "train --seeds 0",
        "train --envs 0",
        "train --threads 0",
        "train --target inf",
        "train --checkpoint-seconds nan",
        "train --checkpoint-seconds inf",
        "train --checkpoint-seconds=-1",
        "train --set left_out=[999] --out nothing",
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
        "plan --starts 0",
        "play --policy nothing",
        "collect --format ogbench --out nothing --snapshots",
        "datasets --out nothing --only nothing",
        "datasets --out nothing --only FetchReach-v4/random --steps 50",
    ] {
        assert_eq!(lab(arguments).output()?.status.code(), Some(2), "{arguments}");
    }
    Ok(())
}

#[test]
fn planned_starts_are_counted_by_the_distance_of_the_goal() -> Result {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("plan.json");
    let text = output_of(lab("plan --env-id FetchReach-v4 --starts 2 --json").arg(&path))?;
    assert!(text.contains("| all | 2 | 1.000 | 1.000 |"), "{text}");
    let output = read_json(&path)?;
    let results = output["results"].as_array().ok_or("no list")?;
    let value = |name: &str| {
        let result = results.iter().find(|result| result["name"] == name);
        result.and_then(|result| result["value"].as_f64()).ok_or(format!("no {name}"))
    };
    assert_eq!(value("plan/FetchReach-v4/all/planned/success_rate")?, 1.0);
    assert!(value("plan/FetchReach-v4/seed-1/planned/final_distance")? < 0.05);

    // Its goal is 0.22 m away. There are no more environments than candidates.
    let text = output_of(&mut lab("plan --starts 1 --seed 3 --threads 40000"))?;
    assert!(text.contains("| 0 to 0.3 m | 1 | 1.000 |"), "{text}");
    assert!(text.contains("| from 0.7 m | 0 | - | - | - | 0 | 0 | 0 | - |"), "{text}");
    Ok(())
}

#[test]
fn the_list_has_the_commands_of_this_program() -> Result {
    let help = output_of(&mut lab("--help"))?;
    let (_, list) = help.split_once("Commands:\n").ok_or("no list")?;
    let lines = list.lines().take_while(|line| !line.is_empty());
    let commands: Vec<_> = lines.filter_map(|line| line.trim().split_once("  ")).collect();
    let commands = commands.iter().map(|(name, about)| (*name, about.trim()));
    let ours: Vec<_> = commands.filter(|(name, _)| *name != "help").collect();
    let listed = commands::of(Program::Lab).map(|command| (command.name, command.about));
    assert_eq!(ours, listed.collect::<Vec<_>>());
    Ok(())
}

#[test]
fn demonstrations_are_scripted_archived_or_saved() -> Result {
    let folder = tempfile::tempdir()?;
    let mut env = make_kinematic("FetchReach-v4")?;
    let mut buffer = HerBuffer::<f64>::new(buffer_config(1_000, &env)?)?;
    let mut script = ScriptedPolicy::new(Task::Reach);
    collect(&mut env, &mut script, 3, 0, &mut buffer, 0, |_| ())?;
    let (archive, saved) = (folder.path().join("demos.npz"), folder.path().join("demos.buffer"));
    buffer.export_npz(&archive)?;
    buffer.save(&saved)?;
    for (run, demos) in [Path::new("3"), &archive, &saved].into_iter().enumerate() {
        let mut train = lab("train --target 2 --steps 100 --set evaluation_episodes=5 --demos");
        train.arg(demos).arg("--out").arg(folder.path().join(run.to_string()));
        let text = output_of(&mut train)?;
        assert!(text.contains("3 episodes of demonstrations"), "{text}");
    }
    let missing =
        lab("train --demos missing.buffer --out").arg(folder.path().join("4")).output()?;
    assert!(errors_of(&missing).contains("--demos missing.buffer"), "{}", errors_of(&missing));
    assert_eq!(missing.status.code(), Some(1));
    Ok(())
}

#[test]
fn a_file_that_cannot_be_written_is_named_and_leaves_nothing() -> Result {
    // No file can have more than 4 KiB, as if the disk was full.
    let full = "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\"";
    for (name, format) in [
        ("episodes.npz", None),
        ("episodes.buffer", None),
        ("data", Some("minari")),
        ("data", Some("ogbench")),
    ] {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join(name);
        let mut collect = lab("collect --episodes 30 --out");
        collect.arg(&path).args(format.map(|format| format!("--format={format}")));
        let output = Command::new("sh")
            .args(["-c", full])
            .arg(collect.get_program())
            .args(collect.get_args())
            .output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(1), "{name}: {errors}");
        let is_named = errors.contains(&path.display().to_string());
        assert!(is_named && errors.contains("File too large"), "{name}: {errors}");
        assert!(fs::read_dir(folder.path())?.next().is_none(), "{name} leaves nothing");
    }
    Ok(())
}

#[test]
fn a_wrong_setting_is_wrong_usage_and_named_with_the_nearest() -> Result {
    for (flags, answer) in [
        ("train --set gama=0.9", "there is no setting gama; did you mean gamma?"),
        ("train --set gamma", "write KEY=VALUE"),
        ("train --set gamma=much", "much is not a number, a list or true"),
        ("train --set hidden=0.5", "0.5 is not a value of hidden"),
        ("train --set batch_size=0", "batch_size is 0: choose from 1 to 8_192"),
        ("train --set noise=1e39", "noise is inf: choose from 0.0 to 10.0"),
        ("train --set hidden=[1000000000000]", "choose from 1 to 1_024 in at most 4 layers"),
        ("train --envs 1000000", "num_envs is 1000000: choose from 1 to 1_024"),
        ("train --demos 100000000000", "choose a whole number from 0 to 10000, or a file"),
        ("train --demos=-1", "choose a whole number from 0 to 10000, or a file"),
        ("train --env-id FetchPsh-v4", "FetchPush-v4"),
    ] {
        let folder = tempfile::tempdir()?;
        let output = lab(flags).arg("--out").arg(folder.path().join("run")).output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(2), "{flags}: {errors}");
        assert!(errors.contains(answer), "{flags}: {errors}");
        assert!(fs::read_dir(folder.path())?.next().is_none(), "{flags} leaves no folder");
    }
    Ok(())
}
