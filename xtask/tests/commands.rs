//! The task runner as a user runs it, without building what it hands commands on to.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io,
    process::{Command, Output},
};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

fn xtask(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
    command.args(arguments.split_whitespace());
    command
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn help_lists_every_command() -> Result {
    let output = xtask("--help").output()?;
    assert_eq!(output.status.code(), Some(0));
    for name in ["test", "ci", "sanitize", "mutants", "parity", "bench", "soak", "tasks-page"] {
        assert!(stdout(&output).contains(&format!("\n  {name} ")), "{name}");
    }
    for arguments in ["help fuzz", "fuzz --help"] {
        let output = xtask(arguments).output()?;
        assert_eq!(output.status.code(), Some(0), "{arguments}");
        assert!(stdout(&output).contains("Usage: cargo xtask fuzz [OPTIONS]"));
    }
    Ok(())
}

/// Returns the names of all commands, from the overview.
fn names() -> Result<Vec<String>> {
    let text = stdout(&xtask("--help").output()?);
    let (_, list) = text.split_once("Commands:\n").ok_or("no list")?;
    let lines = list.lines().take_while(|line| line.starts_with("  "));
    Ok(lines.filter_map(|line| Some(line.split_whitespace().next()?.to_owned())).collect())
}

#[test]
fn the_readme_lists_every_command_and_no_other() -> Result {
    let readme = include_str!("../README.md");
    let rows = readme.lines().filter(|line| line.starts_with("| `"));
    let listed: BTreeSet<_> = rows
        .filter_map(|row| row.split_once("cargo xtask ")?.1.split([' ', '`']).next())
        .map(str::to_owned)
        .collect();
    let names = names()?;
    assert!(names.len() > 10, "{names:?}");
    assert_eq!(listed, names.into_iter().collect());
    Ok(())
}

#[test]
fn what_is_missing_is_listed_at_once_before_the_first_step() -> Result {
    let folder = tempfile::tempdir()?;
    let missing = |command: &str| {
        let mut command = xtask(command);
        command.env("PATH", folder.path()).env("MUJOCO_DIR", "none").output()
    };
    for (command, packages) in [
        ("test", "libmujoco-dev"),
        ("ci", "libmujoco-dev valgrind libc6-dbg python3-pip python3-venv libopenmpi-dev"),
        ("ci --all", "libmujoco-dev git g++ valgrind libc6-dbg python3-pip python3-venv"),
    ] {
        let output = missing(command)?;
        let errors = stderr(&output);
        assert_eq!((output.status.code(), stdout(&output).as_str()), (Some(2), ""), "{errors}");
        let lines: Vec<_> = errors.lines().filter(|line| line.contains("apt-get")).collect();
        let install = "apt-get update && apt-get install -y --no-install-recommends";
        assert_eq!(lines.len(), 1, "{errors}");
        assert!(lines[0].contains(&format!("{install} {packages}")), "{errors}");
    }
    Ok(())
}

/// A signal that ends `cargo xtask train` ends the training, because both are one process.
#[cfg(unix)]
#[test]
fn a_command_that_is_handed_on_is_the_same_process() -> Result {
    use std::os::unix::{fs::PermissionsExt, process::ExitStatusExt};

    // Cargo asks for the compiler's version first. This one writes who asks, and never answers.
    let folder = tempfile::tempdir()?;
    let (compiler, asking) = (folder.path().join("rustc"), folder.path().join("asking"));
    let script = format!(
        "#!/bin/sh\necho $PPID $$ > {0}.new\nmv {0}.new {0}\nexec sleep 60\n",
        asking.display()
    );
    fs::write(&compiler, script)?;
    fs::set_permissions(&compiler, fs::Permissions::from_mode(0o755))?;
    let mut train = xtask("train").env("RUSTC", &compiler).spawn()?;
    while !asking.exists() {
        assert!(train.try_wait()?.is_none(), "it ended before it asked");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let processes = fs::read_to_string(&asking)?;
    let (asks, _) = processes.split_once(' ').ok_or("two processes")?;
    let is_the_same = asks == train.id().to_string();
    assert!(Command::new("sh").arg("-c").arg(format!("kill {processes}")).status()?.success());
    assert!(is_the_same, "{processes}: {}", train.id());
    assert_eq!(train.wait()?.signal(), Some(15));
    Ok(())
}

#[test]
fn a_closed_pipe_ends_a_command_quietly_and_a_full_disk_with_an_error() -> Result {
    for arguments in ["--help", "fuzz --help"] {
        let (reader, writer) = io::pipe()?;
        drop(reader);
        let output = xtask(arguments).stdout(writer).output()?;
        assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""), "{arguments}");
        let output = xtask(arguments).stdout(File::create("/dev/full")?).output()?;
        assert_eq!(output.status.code(), Some(1), "{arguments}");
        let errors = stderr(&output);
        assert!(errors.starts_with("error: cannot write to standard output: No space"), "{errors}");
    }
    let output = xtask("ci now").stderr(File::create("/dev/full")?).output()?;
    assert_eq!(output.status.code(), Some(2));
    Ok(())
}

#[test]
fn wrong_usage_is_exit_code_2() -> Result {
    for arguments in [
        "",
        "ci now",
        "ci --available --install",
        "test now",
        "fuzz --seconds 0",
        "fuzz --target nothing",
        "sanitize --only nothing",
        "sanitize --cases 0",
        "mutants --crate nothing",
        "mutants --shard 2/2",
        "mutants --at-most 0",
        "mutants --commits 0",
        "platforms --only nothing",
        "projects --only nothing",
        "projects --exclude nothing",
        "projects --only burn --exclude burn",
        "projects --exclude burn --only burn",
    ] {
        let output = xtask(arguments).output()?;
        assert_eq!(output.status.code(), Some(2), "{arguments}: {}", stderr(&output));
    }
    Ok(())
}

#[test]
fn without_mujoco_doctor_names_the_problem_and_the_fix() -> Result {
    let output = xtask("doctor").env("MUJOCO_DIR", "/nonexistent").output()?;
    assert_eq!(output.status.code(), Some(1));
    let text = stdout(&output);
    assert!(text.starts_with("FAIL  MuJoCo is missing\n"), "{text}");
    assert!(text.contains("/nonexistent") && text.contains("      fix: apt-get"), "{text}");

    let output = xtask("verify").env("MUJOCO_DIR", "/nonexistent").output()?;
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("cargo xtask mujoco 3.6.0"), "{}", stderr(&output));
    Ok(())
}

#[test]
fn an_empty_mujoco_dir_is_as_good_as_none() -> Result {
    // The search for MuJoCo comes before the search for MPI, which ends this.
    let mut train = xtask("train --mpi");
    let output = train.env("MUJOCO_DIR", "").env("MPICC", "/nonexistent").output()?;
    assert_eq!(output.status.code(), Some(1));
    assert!(!stderr(&output).contains("MUJOCO_DIR names"), "{}", stderr(&output));
    Ok(())
}
