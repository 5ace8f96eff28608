//! Ranks that share a run, started by `mpirun`: the same bits, and a clear end if something fails.
//!
//! The faults are those that a cluster has: ranks that are killed in each phase or stopped, a full
//! disk, missing and damaged files, different flags, settings and seeds. Faults of a network
//! between two hosts are in `hosts`.

mod hosts;

use std::{
    fs,
    io::Read,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use tempfile::{TempDir, tempdir};
use testing::Result;

const PROGRAM: &str = env!("CARGO_BIN_EXE_fetch-env");

/// How long a run may take until it has ended, whatever happens.
const DEADLINE: Duration = Duration::from_secs(180);

/// Small networks, and an evaluation after every 100 steps.
const TRAIN: &str = "train --target 2 --threads 1 --checkpoint-seconds 0 --set hidden=[32,32] \
                     --set evaluation_episodes=4 --set evaluation_interval=100";

/// Returns a command that starts `count` ranks on any machine; the program follows.
fn ranks(count: usize) -> Command {
    let mut command = Command::new("mpirun");
    command
        .args(["--oversubscribe", "-n", &count.to_string()])
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// Returns a command that starts two ranks of the program.
fn two_ranks() -> Command {
    let mut command = ranks(2);
    command.arg(PROGRAM);
    command
}

fn train(flags: &str, out: &Path) -> Command {
    let mut command = two_ranks();
    command.args(words(TRAIN)).arg("--mpi").args(words(flags)).arg("--out").arg(out);
    command
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split_whitespace()
}

struct Ended {
    succeeded: bool,
    code: Option<i32>,
    text: String,
}

impl Ended {
    /// Waits for the end of a run, and returns what it printed.
    fn of(mut child: Child) -> Result<Self> {
        let mut output = child.stdout.take().ok_or("no output")?;
        let mut errors = child.stderr.take().ok_or("no errors")?;
        let read = thread::spawn(move || {
            let mut text = String::new();
            errors.read_to_string(&mut text).map(|_| text)
        });
        let start = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break status;
            }
            if start.elapsed() > DEADLINE {
                child.kill()?;
                return Err("the run hangs".into());
            }
            thread::sleep(Duration::from_millis(20));
        };
        let mut text = String::new();
        output.read_to_string(&mut text)?;
        text += &read.join().map_err(|_| "the reader panicked")??;
        Ok(Self { succeeded: status.success(), code: status.code(), text })
    }

    /// Checks that the run failed with exactly one error, which contains these words.
    fn failed_with(&self, words: &str) {
        let Self { succeeded, text, .. } = self;
        let errors: Vec<_> = text.lines().filter(|line| line.starts_with("error:")).collect();
        assert!(!succeeded && errors.len() == 1 && errors[0].contains(words), "{words}\n{text}");
    }

    /// Checks that the launcher said which rank was killed.
    fn was_killed(&self, rank: usize) {
        let Self { succeeded, text, .. } = self;
        let is_told = text.contains(&format!("process rank {rank}")) && text.contains("signal 9");
        assert!(!succeeded && is_told && !text.contains("error:"), "{text}");
    }
}

fn start(command: &mut Command) -> Result<Child> {
    Ok(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?)
}

fn run(command: &mut Command) -> Result<Ended> {
    Ended::of(start(command)?)
}

/// Returns the processes that a process has started.
fn children(of: u32) -> Result<Vec<u32>> {
    let mut children = Vec::new();
    for process in fs::read_dir("/proc")? {
        let process = process?;
        let status = fs::read_to_string(process.path().join("status")).unwrap_or_default();
        if status.contains(&format!("PPid:\t{of}\n")) {
            children.push(process.file_name().to_string_lossy().parse()?);
        }
    }
    Ok(children)
}

/// Returns the process of a rank of a run.
fn process_of(run: &Child, rank: usize) -> Result<u32> {
    let is_rank = |process: &u32| {
        let environment = fs::read(format!("/proc/{process}/environ")).unwrap_or_default();
        environment
            .split(|byte| *byte == 0)
            .any(|entry| entry == format!("OMPI_COMM_WORLD_RANK={rank}").as_bytes())
    };
    let process = children(run.id())?.into_iter().find(is_rank);
    process.ok_or_else(|| format!("there is no rank {rank}").into())
}

/// Sends a signal to a rank of a run.
fn signal(run: &Child, rank: usize, signal: &str) -> Result {
    let kill = format!("kill {signal} {}", process_of(run, rank)?);
    assert!(Command::new("sh").args(["-c", &kill]).status()?.success());
    Ok(())
}

/// Waits until something is there.
fn wait_for(what: impl Fn() -> bool) -> Result {
    let start = Instant::now();
    while !what() {
        if start.elapsed() > DEADLINE {
            return Err("it never comes".into());
        }
        thread::sleep(Duration::from_millis(1));
    }
    Ok(())
}

/// Starts a run in a folder, and waits until it has its first checkpoint.
fn start_in(folder: &TempDir, flags: &str) -> Result<Child> {
    let out = folder.path().join("run");
    let child = start(&mut train(flags, &out))?;
    wait_for(|| out.join("checkpoint-000000000000.zip").exists())?;
    Ok(child)
}

/// The curve without its column of seconds, and the policy.
type Results = (String, Vec<u8>);

/// Returns the results of a run in a folder.
fn results(folder: &Path) -> Result<Results> {
    let curve = fs::read_to_string(folder.join("curve.csv"))?;
    let without_seconds = |line: &str| {
        let cells = line.split(',').enumerate().filter(|(column, _)| *column != 4);
        cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(",")
    };
    let curve: Vec<_> = curve.lines().map(without_seconds).collect();
    Ok((curve.join("\n"), fs::read(folder.join("policy.safetensors"))?))
}

/// Checks that a run resumes, and ends with the results of one that was not interrupted.
fn resumes_to(out: &Path, whole: &Path) -> Result {
    let flags = ["train", "--mpi", "--threads", "1", "--resume"];
    let resumed = run(two_ranks().args(flags).arg(out))?;
    assert!(resumed.succeeded, "{}", resumed.text);
    assert!(results(out)? == results(whole)?);
    Ok(())
}

#[test]
fn one_rank_has_the_bits_of_a_run_without_mpi_and_two_have_theirs_again() -> Result {
    let folder = tempdir()?;
    let results_of = |name: &str, command: &mut Command, flags: &str| {
        let out = folder.path().join(name);
        command.args(words(TRAIN)).args(words(flags)).arg("--out").arg(&out);
        let ended = run(command)?;
        assert!(ended.succeeded, "{}", ended.text);
        results(&out)
    };
    let shared =
        |name: &str, count: usize| results_of(name, ranks(count).arg(PROGRAM), "--mpi --steps 800");
    let alone = results_of("alone", &mut Command::new(PROGRAM), "--steps 800")?;
    assert!(shared("one", 1)? == alone);
    let two = shared("two", 2)?;
    assert!(two != alone && shared("again", 2)? == two);
    Ok(())
}

#[test]
fn collected_episodes_are_the_same_on_any_number_of_ranks() -> Result {
    let folder = tempdir()?;
    let flags = "collect --env-id FetchPush-v4 --episodes 5 --policy random --out";
    let [alone, shared] = ["alone.npz", "shared.npz"].map(|name| folder.path().join(name));
    assert!(run(Command::new(PROGRAM).args(flags.split(' ')).arg(&alone))?.succeeded);
    assert!(run(two_ranks().args(flags.split(' ')).arg(&shared).arg("--mpi"))?.succeeded);
    assert!(fs::read(alone)? == fs::read(shared)?);
    Ok(())
}

/// Sends a signal to a rank some time after the first checkpoint, and waits for the end of the run.
fn signalled(flags: &str, milliseconds: u64, rank: usize, name: &str) -> Result<Ended> {
    let folder = tempdir()?;
    let child = start_in(&folder, flags)?;
    thread::sleep(Duration::from_millis(milliseconds));
    signal(&child, rank, name)?;
    Ended::of(child)
}

#[test]
fn a_rank_that_is_killed_while_it_collects_ends_the_run() -> Result {
    let flags = "--steps 100000000 --set steps_per_cycle=1000 --set num_envs=400";
    signalled(flags, 500, 1, "-KILL")?.was_killed(1);
    Ok(())
}

#[test]
fn a_rank_that_is_killed_while_it_updates_ends_the_run() -> Result {
    let flags = "--steps 10000 --set updates_per_cycle=10000";
    signalled(flags, 1_500, 1, "-KILL")?.was_killed(1);
    Ok(())
}

#[test]
fn a_rank_that_is_killed_while_it_evaluates_ends_the_run() -> Result {
    let flags = "--steps 10000 --set evaluation_episodes=10000";
    signalled(flags, 2_500, 1, "-KILL")?.was_killed(1);
    Ok(())
}

/// The last checkpoint is whole, and the run ends with the bits of one that was not killed.
#[test]
fn a_first_rank_that_is_killed_while_it_writes_leaves_a_checkpoint_to_resume() -> Result {
    let folder = tempdir()?;
    let whole = folder.path().join("whole");
    assert!(run(&mut train("--steps 1500", &whole))?.succeeded);
    let out = folder.path().join("run");
    let child = start_in(&folder, "--steps 1500")?;
    wait_for(|| out.join("checkpoint-000000000400.zip").exists())?;
    let open = format!("/proc/{}/fd", process_of(&child, 0)?);
    let is_writing = || {
        let files = fs::read_dir(&open).into_iter().flatten().flatten();
        let mut paths = files.filter_map(|file| fs::read_link(file.path()).ok());
        paths.any(|path| path.starts_with(&out) && !path.ends_with("run.lock"))
    };
    wait_for(is_writing)?;
    signal(&child, 0, "-KILL")?;
    Ended::of(child)?.was_killed(0);
    resumes_to(&out, &whole)
}

/// A signal to any rank stops all of them together.
#[test]
fn a_signal_to_a_rank_stops_a_run_that_resumes_to_the_same_bits() -> Result {
    let folder = tempdir()?;
    let whole = folder.path().join("whole");
    assert!(run(&mut train("--steps 500", &whole))?.succeeded);
    for rank in [0, 1] {
        let folder = tempdir()?;
        let out = folder.path().join("run");
        let child = start_in(&folder, "--steps 500")?;
        wait_for(|| out.join("checkpoint-000000000200.zip").exists())?;
        signal(&child, rank, "-TERM")?;
        let stopped = Ended::of(child)?;
        let lines: Vec<_> = stopped.text.lines().filter(|line| line.contains("stopped")).collect();
        assert_eq!(lines.len(), 1, "{}", stopped.text);
        let is_told = lines[0].starts_with("train: stopped by SIGTERM after ")
            && lines[0].ends_with(&format!("continue it with --resume {}", out.display()));
        assert!(is_told && stopped.code == Some(143), "{}", stopped.text);
        resumes_to(&out, &whole)?;
    }
    Ok(())
}

#[test]
fn a_rank_that_is_stopped_is_named() -> Result {
    let flags = "--steps 100000000 --wait-seconds 2";
    for (stopped, other) in [(1, 0), (0, 1)] {
        signalled(flags, 500, stopped, "-STOP")?
            .failed_with(&format!("rank {other}: rank {stopped} has not answered for 2 s"));
    }
    Ok(())
}

#[test]
fn a_rank_that_never_starts_mpi_is_missed() -> Result {
    let mut command = ranks(1);
    command.arg(PROGRAM).args(words("collect --mpi --wait-seconds 2"));
    command.args([":", "-n", "1", "sleep", "1000"]);
    run(&mut command)?.failed_with("rank 0: another rank has not started MPI for 2 s");
    Ok(())
}

#[test]
fn a_rank_that_never_ends_mpi_is_missed() -> Result {
    let folder = tempdir()?;
    // The first rank waits for a reader of the pipe, and the other one has nothing left to do.
    let pipe = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status()?.success());
    let flags = "collect --mpi --episodes 2 --wait-seconds 2 --json";
    run(two_ranks().args(words(flags)).arg(&pipe))?
        .failed_with("rank 1: another rank has not ended MPI for 2 s");
    Ok(())
}

#[test]
fn ranks_with_other_flags_are_named() -> Result {
    for (flags, error) in [
        (format!("{TRAIN} --mpi --steps 200 --seed 3"), "--seed than rank 0: 3"),
        (format!("{TRAIN} --mpi --steps 300"), "--steps than rank 0: Some(300)"),
        (
            format!("{TRAIN} --mpi --steps 200 --set gamma=0.9"),
            "gamma than rank 0: 0.9 instead of 0.95",
        ),
        ("collect --mpi --episodes 3".to_owned(), "command than rank 0: collect instead of train"),
    ] {
        let mut command = ranks(1);
        command.arg(PROGRAM).args(words(TRAIN)).args(["--mpi", "--steps", "200"]);
        command.args(["--out", "target/unused", ":", "-n", "1", PROGRAM]).args(words(&flags));
        run(&mut command)?.failed_with(&format!("rank 1 has a different {error}"));
    }
    Ok(())
}

#[test]
fn a_rank_without_a_file_that_it_needs_says_so() -> Result {
    let folder = tempdir()?;
    let demos = folder.path().join("demos.npz");
    let collect = ["collect", "--episodes", "2", "--policy", "scripted", "--out"];
    assert!(run(Command::new(PROGRAM).args(collect).arg(&demos))?.succeeded);
    let out = folder.path().join("run");
    let flags = format!("{TRAIN} --mpi --steps 200 --demos demos.npz --out {}", out.display());
    let mut command = ranks(1);
    command.arg("--wdir").arg(folder.path()).arg(PROGRAM).args(words(&flags));
    command.args([":", "-n", "1", "--wdir", "/", PROGRAM]).args(words(&flags));
    run(&mut command)?.failed_with("rank 1: --demos demos.npz: cannot read the archive");
    Ok(())
}

#[test]
fn a_checkpoint_that_cannot_be_written_ends_the_run_and_leaves_the_last_one() -> Result {
    let folder = tempdir()?;
    let out = folder.path().join("run");
    let child = start_in(&folder, "--steps 100000000")?;
    wait_for(|| out.join("checkpoint-000000000200.zip").exists())?;
    // The path of a later one is taken.
    let taken = out.join("checkpoint-000000000600.zip");
    fs::create_dir(&taken)?;
    Ended::of(child)?.failed_with("600.zip is not a checkpoint of this run");
    fs::remove_dir(taken)?;
    let flags = ["train", "--mpi", "--steps", "700", "--resume"];
    let resumed = run(two_ranks().args(flags).arg(&out))?;
    let is_resumed = resumed.text.contains("train: resuming");
    assert!(resumed.succeeded && is_resumed, "{}", resumed.text);
    Ok(())
}

#[test]
fn what_all_ranks_see_is_told_once() -> Result {
    let folder = tempdir()?;
    let out = folder.path().join("run");
    run(&mut train("--steps 1000 --set num_envs=3", &out))?
        .failed_with("rank 0: num_envs is 3: choose a multiple of the number of processes");
    assert!(run(&mut train("--steps 100", &out))?.succeeded);
    run(&mut train("--steps 1000", &out))?
        .failed_with(&format!("rank 0: {} has a run: continue it with --resume", out.display()));
    fs::write(out.join("checkpoint-000000009999.zip"), "damaged")?;
    run(two_ranks().args(["train", "--mpi", "--resume"]).arg(&out))?.failed_with("is damaged");
    Ok(())
}

/// A run resumed on the same number of ranks is exact; on another, it says what is not exact.
#[test]
fn a_run_resumed_on_other_ranks_says_what_is_not_exact() -> Result {
    let folder = tempdir()?;
    let out = folder.path().join("run");
    assert!(run(&mut train("--steps 400", &out))?.succeeded);
    let flags = ["train", "--steps", "800", "--threads", "1", "--resume"];
    let resumed = run(Command::new(PROGRAM).args(flags).arg(&out))?;
    assert!(resumed.succeeded, "{}", resumed.text);
    assert!(resumed.text.contains("the checkpoint is from 2 ranks, and this run has 1"));
    Ok(())
}

#[test]
fn runs_that_are_not_started_together_say_what_to_do() -> Result {
    run(Command::new(PROGRAM).args(["train", "--mpi"]))?.failed_with("start it with `mpirun -n 2`");
    let ended = run(two_ranks().args(["train", "--steps", "200"]))?;
    assert!(!ended.succeeded && ended.text.contains("add --mpi"), "{}", ended.text);
    Ok(())
}
