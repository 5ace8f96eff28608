//! Runs of training as a user starts, kills, stops, resumes and overwrites them.

mod program;

use std::{
    collections::BTreeMap,
    ffi::OsString,
    fs,
    os::unix::{fs::symlink, process::ExitStatusExt},
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

use program::fetch;
use tempfile::tempdir;
use testing::{
    Result,
    program::{errors_of, output_of, read_json},
};

/// Returns the command of a run with small networks, and evaluations and, unless the flags say
/// otherwise, checkpoints after every 100 steps.
fn train(flags: &str, out: &Path) -> Command {
    let mut command = fetch(
        "train --target 2 --threads 1 --set hidden=[32,32] --set evaluation_episodes=5 \
         --set evaluation_interval=100",
    );
    if !flags.contains("--checkpoint-seconds") {
        command.args(["--checkpoint-seconds", "0"]);
    }
    command.args(flags.split_whitespace()).arg("--out").arg(out);
    command
}

fn resume(out: &Path) -> Command {
    let mut command = fetch("train --threads 2 --resume");
    command.arg(out);
    command
}

/// Waits until there is something, or the run has ended.
fn wait_for(run: &mut Child, what: impl Fn() -> bool) -> Result {
    while !what() && run.try_wait()?.is_none() {
        thread::sleep(Duration::from_millis(1));
    }
    Ok(())
}

/// Starts a run, and waits until it has saved a checkpoint after its first steps.
fn start(flags: &str, out: &Path) -> Result<Child> {
    let mut run = train(flags, out).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
    wait_for(&mut run, || num_checkpoints(out) > 1)?;
    assert!(run.try_wait()?.is_none(), "the run has ended");
    Ok(run)
}

fn num_checkpoints(out: &Path) -> usize {
    let entries = fs::read_dir(out).into_iter().flatten().flatten();
    entries.filter(|entry| entry.path().extension().is_some_and(|end| end == "zip")).count()
}

fn send(signal: &str, run: &Child) -> Result {
    // The shell's own command, because not every machine has the program.
    let kill = format!("kill {signal} {}", run.id());
    assert!(Command::new("sh").args(["-c", &kill]).status()?.success());
    Ok(())
}

fn policy(out: &Path) -> Result<Vec<u8>> {
    Ok(fs::read(out.join("policy.safetensors"))?)
}

/// Returns the files of a folder and their contents.
fn contents(folder: &Path) -> Result<BTreeMap<OsString, Vec<u8>>> {
    let file = |entry: fs::DirEntry| Ok((entry.file_name(), fs::read(entry.path())?));
    fs::read_dir(folder)?.map(|entry| file(entry?)).collect()
}

#[test]
fn a_killed_run_resumes_to_the_same_bits() -> Result {
    let folder = tempdir()?;
    let [whole, killed] = ["whole", "killed"].map(|name| folder.path().join(name));
    output_of(&mut train("--seed 2 --steps 800", &whole))?;
    // Kill it while it runs, at an arbitrary moment.
    let mut run = start("--seed 2 --steps 800", &killed)?;
    run.kill()?;
    run.wait()?;
    output_of(&mut resume(&killed))?;
    assert!(policy(&whole)? == policy(&killed)?, "the policies differ");
    Ok(())
}

#[test]
fn a_signal_stops_a_run_that_resumes_to_the_same_bits() -> Result {
    let folder = tempdir()?;
    let whole = folder.path().join("whole");
    // No checkpoint is due, so that the last one is the signal's.
    let flags = "--seed 2 --steps 600 --set evaluation_interval=250 --checkpoint-seconds 1000";
    output_of(&mut train(flags, &whole))?;
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let out = folder.path().join(format!("stopped by {signal}"));
        let mut run = train(flags, &out).stderr(Stdio::piped()).spawn()?;
        wait_for(&mut run, || out.join("curve.csv").exists())?;
        send(signal, &run)?;
        let output = run.wait_with_output()?;
        let errors = errors_of(&output);
        assert_eq!(output.status.code(), Some(code), "{errors}");
        let (steps, how) = errors
            .trim_end()
            .strip_prefix(&format!("train: stopped by SIG{} after ", &signal[1..]))
            .and_then(|rest| rest.split_once(" steps: continue it with "))
            .ok_or("another line")?;
        assert_eq!(how, format!("--resume '{}'", out.display()));
        let steps: u64 = steps.parse()?;
        assert!(out.join(format!("checkpoint-{steps:012}.zip")).exists() && steps < 600);
        assert!(policy(&out).is_err());
        output_of(&mut resume(&out))?;
        assert!(policy(&whole)? == policy(&out)?, "the policies differ");
    }
    Ok(())
}

#[test]
fn a_second_signal_ends_a_run_at_once_and_one_alone_other_commands() -> Result {
    let folder = tempdir()?;
    let out = folder.path().join("run");
    let mut run = train("--steps 1000 --set updates_per_cycle=10000", &out).spawn()?;
    wait_for(&mut run, || out.join("curve.csv").exists())?;
    send("-INT", &run)?;
    send("-TERM", &run)?;
    let signal = run.wait()?.signal();
    assert!(signal.is_some_and(|signal| [2, 15].contains(&signal)), "{signal:?}");
    for (signal, number) in [("-INT", 2), ("-TERM", 15)] {
        let collect = fetch("collect --policy random --episodes 1000000 --out");
        // Shells start background programs, and so these tests, with SIGINT ignored.
        let mut run = Command::new("env")
            .arg("--default-signal=INT")
            .arg(collect.get_program())
            .args(collect.get_args())
            .arg(folder.path().join("episodes.npz"))
            .spawn()?;
        // Until env has become the command, SIGINT may be ignored.
        let program = format!("/proc/{}/exe", run.id());
        wait_for(&mut run, || {
            fs::read_link(&program).is_ok_and(|path| path.ends_with("fetch-env"))
        })?;
        send(signal, &run)?;
        assert_eq!(run.wait()?.signal(), Some(number));
    }
    Ok(())
}

#[test]
fn a_signal_to_the_writer_of_data_sets_leaves_nothing() -> Result {
    let folder = tempdir()?;
    fs::write(folder.path().join("thesis.txt"), "a thesis")?;
    for (arguments, place) in [
        ("datasets --only FetchReach-v4,FetchPush-v4/replay --out", "minari"),
        ("collect --format ogbench --episodes 1000000 --out", "."),
    ] {
        for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
            let out = folder.path().join("data");
            let mut command = fetch(arguments);
            let mut run = command.arg(&out).stderr(Stdio::piped()).spawn()?;
            let hidden = |path: &Path| {
                let entries = fs::read_dir(path).into_iter().flatten().flatten();
                entries.filter(|entry| entry.file_name().as_encoded_bytes()[0] == b'.').count()
            };
            wait_for(&mut run, || hidden(&out.join(place)) > 0)?;
            send(signal, &run)?;
            let output = run.wait_with_output()?;
            let errors = errors_of(&output);
            assert_eq!(output.status.code(), Some(code), "{arguments} {signal}: {errors}");
            assert!(errors.contains("removed the unfinished"), "{errors}");
            assert_eq!(fs::read_dir(folder.path())?.count(), 1, "{arguments} {signal}");
        }
    }
    Ok(())
}

#[test]
fn overwriting_removes_what_a_run_wrote_and_nothing_else() -> Result {
    let folder = tempdir()?;
    let [target, out] = ["target", "link"].map(|name| folder.path().join(name));
    fs::create_dir_all(target.join("photos"))?;
    fs::write(target.join("photos/1.jpg"), "a photo")?;
    fs::write(target.join("thesis.txt"), "a thesis")?;
    fs::write(target.join("checkpoint-best.zip"), "the user's")?;
    symlink("target", &out)?;
    output_of(&mut train("--steps 300 --seed 1", &out))?;
    let names: Vec<_> = contents_of_run(&out)?.into_keys().collect();
    assert_eq!(
        names,
        [
            "checkpoint-000000000200.zip",
            "checkpoint-000000000300.zip",
            "curve.csv",
            "page.html",
            "policy.safetensors",
            "run.json",
            "run.lock",
        ]
    );
    // Errors are found before anything is removed.
    let before = contents_of_run(&out)?;
    for (flags, words) in [
        ("", "has a run: continue it with --resume, replace it with --overwrite"),
        ("--overwrite --demos missing.npz", "--demos missing.npz: cannot read the archive"),
        ("--overwrite --set batch_size=0", "batch_size is 0"),
    ] {
        let output = train(flags, &out).output()?;
        let errors = errors_of(&output);
        assert!(!output.status.success() && errors.contains(words), "{flags}: {errors}");
        assert!(contents_of_run(&out)? == before, "{flags}");
    }
    output_of(&mut train("--steps 100 --seed 2 --overwrite", &out))?;
    assert!(out.is_symlink(), "the link is one still");
    assert_eq!(read_json(&out.join("run.json"))?["seed"], 2);
    assert_eq!(fs::read_to_string(target.join("photos/1.jpg"))?, "a photo");
    assert_eq!(fs::read_to_string(target.join("thesis.txt"))?, "a thesis");
    assert_eq!(fs::read_to_string(target.join("checkpoint-best.zip"))?, "the user's");
    let names: Vec<_> = contents_of_run(&out)?.into_keys().collect();
    assert!(!names.contains(&"checkpoint-000000000300.zip".into()), "{names:?}");
    Ok(())
}

/// Returns the contents of a folder, except the user's files of a test.
fn contents_of_run(out: &Path) -> Result<BTreeMap<OsString, Vec<u8>>> {
    let is_users = |name: &OsString| {
        ["photos", "thesis.txt", "checkpoint-best.zip"].iter().any(|other| name == other)
    };
    let names = fs::read_dir(out)?.map(|entry| Ok(entry?.file_name()));
    let names = names.filter(|name: &Result<_>| !name.as_ref().is_ok_and(is_users));
    names.map(|name| name.and_then(|name| Ok((name.clone(), fs::read(out.join(name))?)))).collect()
}

#[test]
fn a_folder_of_something_else_is_not_overwritten() -> Result {
    for (file, text, flags, words) in [
        ("thesis.txt", "a thesis", "--overwrite", "is not the folder of a run"),
        ("run.json", "{\"of\": \"another program\"}", "--overwrite", "run.json is damaged"),
        ("run.json", "{\"of\": \"another program\"}", "", "run.json is damaged"),
        ("policy.safetensors", "a policy", "", "there is no run.json beside it"),
        ("checkpoint-000000000000.zip", "", "--overwrite", "there is no run.json beside it"),
    ] {
        let out = tempdir()?;
        fs::write(out.path().join(file), text)?;
        let before = contents(out.path())?;
        let output = train(flags, out.path()).output()?;
        let errors = errors_of(&output);
        assert!(output.status.code() == Some(1) && errors.contains(words), "{file}: {errors}");
        assert!(contents(out.path())? == before, "{file}");
    }
    // A run may begin beside the user's files.
    let out = tempdir()?;
    fs::write(out.path().join("thesis.txt"), "a thesis")?;
    output_of(&mut train("--steps 100", out.path()))?;
    assert_eq!(fs::read_to_string(out.path().join("thesis.txt"))?, "a thesis");
    Ok(())
}

/// Whenever it is killed, either the old run can be resumed or a new one started, and the other
/// command says what to do instead.
#[test]
fn a_killed_overwrite_leaves_a_run_to_resume_or_a_folder_to_start_in() -> Result {
    let folder = tempdir()?;
    let out = folder.path().join("run");
    output_of(&mut train("--steps 200", &out))?;
    let gone = |name: &str| !out.join(name).exists();
    let moments: [&dyn Fn() -> bool; 4] = [
        &|| gone("page.html"),
        &|| gone("curve.csv"),
        &|| gone("checkpoint-000000000100.zip"),
        &|| num_checkpoints(&out) == 0,
    ];
    for moment in moments {
        let mut run = train("--steps 200 --overwrite", &out).spawn()?;
        wait_for(&mut run, moment)?;
        run.kill()?;
        run.wait()?;
        let has_checkpoint = num_checkpoints(&out) > 0;
        let start = || train("--steps 200", &out);
        let (mut works, mut other, words) = match has_checkpoint {
            true => (resume(&out), start(), "continue it with --resume"),
            false => (start(), resume(&out), "start the run again, without --resume"),
        };
        let errors = errors_of(&other.output()?);
        assert!(errors.contains(words), "{errors}");
        output_of(&mut works)?;
    }
    // The same for a folder with only a description.
    for entry in fs::read_dir(&out)? {
        let path = entry?.path();
        if !path.ends_with("run.json") {
            fs::remove_file(path)?;
        }
    }
    assert!(errors_of(&resume(&out).output()?).contains("start the run again"));
    output_of(&mut train("--steps 200", &out))?;
    Ok(())
}

#[test]
fn one_process_at_a_time_writes_in_a_folder() -> Result {
    let folder = tempdir()?;
    let out = folder.path().join("run");
    let mut run = start("--steps 100000000", &out)?;
    let description = fs::read(out.join("run.json"))?;
    for mut second in [train("--overwrite --steps 100", &out), resume(&out)] {
        let output = second.output()?;
        let (errors, holder) = (errors_of(&output), format!("process {} on ", run.id()));
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(errors.contains(&holder) && errors.contains("is using the folder"), "{errors}");
    }
    assert!(run.try_wait()?.is_none() && fs::read(out.join("run.json"))? == description);
    // A killed process no longer has the lock.
    run.kill()?;
    run.wait()?;
    output_of(resume(&out).args(["--steps", "1"]))?;
    Ok(())
}

#[test]
fn of_two_starts_at_the_same_time_one_has_the_folder() -> Result {
    for round in 0..3 {
        let folder = tempdir()?;
        let out = folder.path().join("run");
        let start = |seed: u32| {
            train(&format!("--steps 100 --seed {seed}"), &out)
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
        };
        let runs = [start(1)?, start(2)?];
        let mut succeeded = Vec::new();
        for (seed, run) in (1..).zip(runs) {
            let output = run.wait_with_output()?;
            let errors = errors_of(&output);
            if output.status.success() {
                succeeded.push(seed);
            } else {
                let is_told =
                    errors.contains("is using the folder") || errors.contains("has a run");
                assert!(is_told, "round {round}: {errors}");
            }
        }
        assert_eq!(succeeded.len(), 1, "round {round}");
        assert_eq!(read_json(&out.join("run.json"))?["seed"], succeeded[0]);
        let resumed = output_of(resume(&out).args(["--steps", "1"]))?;
        assert!(resumed.contains(&format!("seed {}: ", succeeded[0])), "{resumed}");
    }
    Ok(())
}

#[test]
fn links_in_a_folder_lead_to_no_victim() -> Result {
    let folder = tempdir()?;
    let [out, victim] = ["run", "victim.txt"].map(|name| folder.path().join(name));
    fs::write(&victim, "the user's")?;
    output_of(&mut train("--steps 100", &out))?;
    for name in ["curve.csv", "page.html", "policy.safetensors"] {
        fs::remove_file(out.join(name))?;
        symlink("../victim.txt", out.join(name))?;
    }
    symlink("../victim.txt", out.join("unfinished.zip"))?;
    output_of(resume(&out).args(["--steps", "200"]))?;
    assert!(!out.join("curve.csv").is_symlink());
    fs::remove_file(out.join("run.lock"))?;
    symlink("../victim.txt", out.join("run.lock"))?;
    let errors = errors_of(&resume(&out).output()?);
    assert!(errors.contains("cannot lock"), "{errors}");
    assert_eq!(fs::read_to_string(&victim)?, "the user's");
    Ok(())
}

#[test]
fn names_of_curves_lead_to_no_other_folder() -> Result {
    let folder = tempdir()?;
    let [run, curves] = ["run", "curves"].map(|name| folder.path().join(name));
    output_of(&mut train("--steps 100", &run))?;
    let description = fs::read_to_string(run.join("run.json"))?;
    let forged = |part: &str, forged: &str| -> Result {
        let mut value: serde_json::Value = serde_json::from_str(&description)?;
        value[part] = serde_json::from_str(forged)?;
        Ok(fs::write(run.join("run.json"), value.to_string())?)
    };
    for (part, value) in [
        ("changes", r#"["/../../pwned"]"#),
        ("changes", r#"["/tmp/pwned", "\u0000"]"#),
        ("changes", r#"["..%2F..%2Fpwned"]"#),
        ("demos", r#""pwned/..""#),
        ("demos", r#""/etc/pw\\ned""#),
        ("env_id", r#""FetchReach-v4/../../../pwned""#),
    ] {
        forged(part, value)?;
        // One that is refused writes nothing.
        fetch("learning-curves --folder").args([&curves, &run]).output()?;
    }
    let names = |folder: &Path| -> Result<Vec<_>> {
        let names = fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name()));
        names.collect::<Result<Vec<OsString>>>()
    };
    let mut beside = names(folder.path())?;
    beside.sort();
    assert_eq!(beside, ["curves", "run"]);
    assert_eq!(names(&curves)?.len(), 3 * 5, "{:?}", names(&curves)?);
    Ok(())
}

#[test]
fn a_run_in_a_varied_world_resumes_to_the_same_bits() -> Result {
    let folder = tempdir()?;
    let [whole, killed] = ["whole", "killed"].map(|name| folder.path().join(name));
    let flags = "--seed 2 --steps 400 --vary gravity=5..12 --noise observation=0.02 --noise \
                 action=0.05";
    output_of(&mut train(flags, &whole))?;
    let mut run = start(flags, &killed)?;
    run.kill()?;
    run.wait()?;
    output_of(&mut resume(&killed))?;
    assert!(policy(&whole)? == policy(&killed)?, "the policies differ");
    let plain = folder.path().join("plain");
    output_of(&mut train("--seed 2 --steps 400", &plain))?;
    assert!(policy(&whole)? != policy(&plain)?, "nothing varies");
    let text = fs::read_to_string(whole.join("run.json"))?;
    let noise = [r#""actor_observation_noise=0.02""#, r#""action_noise=0.05""#];
    for part in [r#""gravity""#].into_iter().chain(noise) {
        assert!(text.contains(part), "{part}: {text}");
    }
    Ok(())
}

#[test]
fn a_run_that_started_from_a_policy_resumes_without_it() -> Result {
    let folder = tempdir()?;
    let [taught, whole, killed] =
        ["taught", "whole", "killed"].map(|name| folder.path().join(name));
    output_of(&mut train("--steps 400", &taught))?;
    let board = folder.path().join("board");
    let file = taught.join("policy.safetensors");
    let flags = format!(
        "--seed 2 --steps 400 --start {} --tensorboard {}",
        file.display(),
        board.display()
    );
    output_of(&mut train(&flags, &whole))?;
    let mut run = start(&flags, &killed)?;
    run.kill()?;
    run.wait()?;
    fs::remove_file(&file)?;
    output_of(&mut resume(&killed))?;
    assert!(policy(&whole)? == policy(&killed)?, "the policies differ");
    let text = fs::read_to_string(whole.join("run.json"))?;
    assert!(text.contains("FetchReach-v4, seed 0, 400 steps"), "{text}");
    assert_eq!(fs::read_dir(board.join("seed-2"))?.count(), 2);
    Ok(())
}
