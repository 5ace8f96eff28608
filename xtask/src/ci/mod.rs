//! `test` and `ci`: the tests that a newcomer runs, and all that continuous integration runs.

mod needs;
mod steps;

use std::{
    io::{self, Seek},
    panic,
    path::{Path, PathBuf},
    process::Command,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::Instant,
};

use anyhow::{Error, ensure};
use fetch_install::{Origin, Places, download};

use self::{
    needs::{Need, commands_for},
    steps::{BESIDE, FIRST, LAST, LONGEST, Stage, Step, TESTS},
};
use crate::{c_compiler, output::usage, tools::succeeds};

#[derive(clap::Args)]
pub struct Args {
    /// Also run what takes longest, as before a release: fuzzing, ThreadSanitizer, Miri, mutants of
    /// the last commits, many steps, packages, wheels, the projects with burn and candle, and more
    /// tests on other versions of MuJoCo
    #[arg(long)]
    all: bool,
    /// Skip the steps that need something missing, and list them
    #[arg(long)]
    available: bool,
    /// Install what is missing, with apt-get and rustup
    #[arg(long, conflicts_with = "available")]
    install: bool,
}

pub fn test() -> anyhow::Result<bool> {
    let stages = [&[BESIDE][..], &FIRST, &[LAST]].concat();
    let missing = find_missing(&stages)?;
    let (needed, others): (Vec<_>, Vec<_>) =
        missing.into_iter().partition(|need| TESTS.needs.contains(need));
    if !needed.is_empty() {
        return Err(refusal("test", &needed));
    }
    say_mujoco()?;
    if !run_stages(&[TESTS], &[], Printed::AsItComes, &AtomicBool::new(false))? {
        return Ok(false);
    }
    say!("== all passed. `cargo xtask ci` also runs:")?;
    say_steps(steps_of(&stages), &others)?;
    Ok(true)
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let &Args { all, available, install } = args;
    let first = [&[TESTS][..], &FIRST].concat();
    let mut then = vec![LAST];
    if all {
        then.extend(LONGEST);
    }
    let stages = [&first[..], &[BESIDE], &then].concat();
    let mut missing = find_missing(&stages)?;
    if install {
        for command in commands_for(&missing) {
            say!("== {command}")?;
            let status = Command::new("sh").args(["-c", &command]).status()?;
            ensure!(status.success(), "`{command}` failed");
        }
        missing = find_missing(&stages)?;
    }
    if !available && !missing.is_empty() {
        return Err(refusal("ci", &missing));
    }
    say_mujoco()?;
    let passed = run_beside(&first, &[BESIDE], &missing)?
        && run_stages(&then, &missing, Printed::AsItComes, &AtomicBool::new(false))?;
    if !passed {
        return Ok(false);
    }
    if missing.is_empty() {
        say!("== all passed")?;
        return Ok(true);
    }
    say!("== everything that could run passed. Skipped:")?;
    say_steps(steps_of(&stages).filter(|step| step.lacks(&missing)), &missing)?;
    Ok(true)
}

/// Returns what the steps need and is missing.
fn find_missing(stages: &[Stage]) -> anyhow::Result<Vec<Need>> {
    // If MUJOCO_DIR is wrong, installing something does not help.
    Places::of_machine().find(c_compiler)?;
    let is_missing =
        |need: &Need| steps_of(stages).any(|step| step.lacks(&[*need])) && !need.is_there();
    Ok(Need::ALL.into_iter().filter(is_missing).collect())
}

/// Says on which MuJoCo the steps run that name none: the one that any build takes.
fn say_mujoco() -> anyhow::Result<()> {
    let Some(found) = Places::of_machine().find(c_compiler)? else { return Ok(()) };
    let way_back = match found.origin {
        Origin::Remembered(_) => "; `cargo xtask mujoco system` returns to the system's",
        _ => "",
    };
    say!("== on {}, headers in {}{way_back}", found.origin, found.include.display())
}

/// Returns the error of a command that needs something missing: the machine is not ready for it, so
/// it ends as it does for wrong usage.
fn refusal(command: &str, missing: &[Need]) -> Error {
    let mut lines = vec![format!("`{command}` needs these, which are missing:")];
    lines.extend(missing.iter().map(|need| format!("  {}", need.name())));
    lines.push("To install it:".into());
    lines.extend(commands_for(missing).iter().map(|command| format!("  {command}")));
    if command == "ci" {
        lines.push("`cargo xtask ci --available` runs the steps that need none of them.".into());
    }
    usage(lines.join("\n"))
}

/// A step of a stage.
#[derive(Clone, Copy)]
struct Placed<'a> {
    stage: &'a Stage,
    step: &'a Step,
}

fn steps_of(stages: &[Stage]) -> impl Iterator<Item = Placed<'_>> {
    stages.iter().flat_map(|stage| stage.steps.iter().map(move |step| Placed { stage, step }))
}

impl Placed<'_> {
    fn needs(&self) -> impl Iterator<Item = Need> {
        self.stage.needs.iter().chain(self.step.needs).copied()
    }

    fn lacks(&self, missing: &[Need]) -> bool {
        self.needs().any(|need| missing.contains(&need))
    }

    fn title(&self) -> String {
        match self.stage.mujoco {
            Some(mujoco) => format!("{} (MuJoCo {mujoco})", self.step.purpose),
            None => self.step.purpose.to_owned(),
        }
    }

    fn run(&self, mujoco_dir: Option<&Path>, printed: Printed) -> anyhow::Result<bool> {
        let (title, command) = (self.title(), self.step.command);
        say!("== {title}: cargo {command}")?;
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(command.split(' ')).env("RUSTDOCFLAGS", "-D warnings");
        // With these set, tests of pictures, of pages and of two hosts fail instead of skipping.
        if self.step.needs.is_empty() {
            cargo.env_remove("CI").env_remove("MUJOCO_GL");
        } else {
            cargo.env("CI", "1").env("MUJOCO_GL", "egl");
        }
        if let Some(dir) = mujoco_dir {
            cargo.env("MUJOCO_DIR", dir);
        }
        let start = Instant::now();
        let passed = match printed {
            Printed::AsItComes => succeeds(&mut cargo)?,
            Printed::AtTheEnd => {
                // A pipe would stay open as long as a daemon that the command started.
                let mut output = tempfile::tempfile()?;
                cargo.stdout(output.try_clone()?).stderr(output.try_clone()?);
                let passed = succeeds(&mut cargo)?;
                output.rewind()?;
                say!("== {title}: output")?;
                io::copy(&mut output, &mut io::stdout().lock())?;
                passed
            }
        };
        let outcome = if passed { "passed" } else { "failed" };
        say!("== {title}: {outcome} in {} s", start.elapsed().as_secs())?;
        Ok(passed)
    }
}

/// When the output of a step is printed.
#[derive(Clone, Copy)]
enum Printed {
    AsItComes,
    /// All at once, so that it does not mix with that of steps that run at the same time.
    AtTheEnd,
}

/// Runs the steps of stages that need nothing missing, until one fails, here or in the stages that
/// run beside these.
fn run_stages(
    stages: &[Stage],
    missing: &[Need],
    printed: Printed,
    failed: &AtomicBool,
) -> anyhow::Result<bool> {
    for stage in stages {
        let steps = stage.steps.iter().map(|step| Placed { stage, step });
        let steps: Vec<_> = steps.filter(|step| !step.lacks(missing)).collect();
        let mujoco_dir: Option<PathBuf> = match stage.mujoco {
            Some("none") => Some("none".into()),
            Some(version) if !steps.is_empty() => Some(download::mujoco(version)?),
            _ => None,
        };
        for step in steps {
            if failed.load(Ordering::Relaxed) || !step.run(mujoco_dir.as_deref(), printed)? {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

/// Runs stages beside others, because a step that waits for one test or one download leaves
/// processors idle.
fn run_beside(stages: &[Stage], others: &[Stage], missing: &[Need]) -> anyhow::Result<bool> {
    let failed = AtomicBool::new(false);
    let run = |stages: &[Stage], printed| {
        let passed = run_stages(stages, missing, printed, &failed);
        if !matches!(passed, Ok(true)) {
            failed.store(true, Ordering::Relaxed);
        }
        passed
    };
    thread::scope(|scope| {
        let others = scope.spawn(|| run(others, Printed::AtTheEnd));
        let passed = run(stages, Printed::AsItComes);
        let others = others.join().unwrap_or_else(|panic| panic::resume_unwind(panic));
        // An error of either lane is reported, even if the other one stopped because of it.
        let (passed, others) = (passed?, others?);
        Ok(passed && others)
    })
}

/// Prints steps, grouped by what they lack, and how to install that.
fn say_steps<'a>(steps: impl Iterator<Item = Placed<'a>>, missing: &[Need]) -> anyhow::Result<()> {
    let mut groups: Vec<(Vec<Need>, Vec<String>)> = Vec::new();
    for step in steps {
        let lacking: Vec<_> = step.needs().filter(|need| missing.contains(need)).collect();
        match groups.iter_mut().find(|(known, _)| *known == lacking) {
            Some((_, titles)) => titles.push(step.title()),
            None => groups.push((lacking, vec![step.title()])),
        }
    }
    for (lacking, titles) in groups {
        say!("  {}", titles.join(", "))?;
        for command in commands_for(&lacking) {
            say!("      {command}")?;
        }
    }
    Ok(())
}
