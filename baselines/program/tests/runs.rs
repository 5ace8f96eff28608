//! Runs of training as a user starts, kills, stops and resumes them.

mod folders;
mod program;

use std::{
    fs,
    os::unix::process::ExitStatusExt,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

use program::fetch;
use tempfile::tempdir;
use testing::{
    Result,
    program::{errors_of, output_of},
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
