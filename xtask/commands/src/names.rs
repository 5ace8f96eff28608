//! The list of all commands: the program that has each, and a line that says what it does.

/// The program that has a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program {
    /// xtask itself, which builds without MuJoCo.
    Xtask,
    /// The package `chapter`, which builds without the learner, plots and archives.
    Chapter,
    /// The package `lab`.
    Lab,
}

/// A command, as the list has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Listed {
    /// The program that has it.
    pub program: Program,
    /// Its name, the first argument.
    pub name: &'static str,
    /// What it does, in a line.
    pub about: &'static str,
}

use Program::{Chapter, Lab, Xtask};

/// All commands of `cargo xtask`, in the order in which its help lists them.
pub const COMMANDS: [Listed; 27] = [
    command(Chapter, "verify", "Verify every claim of the chapter by stepping the environments"),
    command(
        Chapter,
        "bridge",
        "Compare hand-computed rewards with the environment's, step by step",
    ),
    command(Chapter, "describe", "Write the observation and action spaces as JSON"),
    command(
        Chapter,
        "reward-check",
        "Check that step, compute_reward and the distance formula agree",
    ),
    command(Chapter, "random-episodes", "Run a random policy and write its results as JSON"),
    command(Chapter, "all", "Run describe, reward-check and random-episodes"),
    command(Chapter, "exercise", "Answer one of the chapter's exercises, 1 to 4"),
    command(Chapter, "doctor", "Look for the usual problems, and say how to fix them"),
    command(Chapter, "task-pages", "Write a page for each task from the tables in the code"),
    command(
        Lab,
        "parity",
        "Compare with the real environment: recorded, live, pictures, samples, policies",
    ),
    command(Lab, "bench", "Measure speed and memory"),
    command(Lab, "figures", "Draw the chapter's pictures, and Slide's"),
    command(Lab, "report", "Write one page with checks, baselines, plots and playbacks"),
    command(Lab, "play", "Write a page that plays one episode back"),
    command(Lab, "collect", "Run a policy, and save its episodes"),
    command(Lab, "train", "Train a policy, with its learning curve and a page"),
    command(
        Lab,
        "learning-curves",
        "Gather runs, say when they reached their targets, and draw their curves",
    ),
    command(
        Lab,
        "soak",
        "Step, save and draw environments for a long time, and look for what they leave behind",
    ),
    command(Xtask, "assets", "Fetch the reference's model into the cache"),
    command(Xtask, "mujoco", "Fetch another version of MuJoCo into the cache"),
    command(
        Xtask,
        "fuzz",
        "Fuzz what is loaded, and sequences of calls of the replay buffer and of environments",
    ),
    command(Xtask, "sanitize", "Run tests under sanitizers, Valgrind and Miri"),
    command(Xtask, "mutants", "Change the code in small ways, and look whether a test notices"),
    command(Xtask, "packages", "Check that the crates are ready to be published"),
    command(
        Xtask,
        "projects",
        "Test the projects that use the crates from outside, and the README's first program",
    ),
    command(
        Xtask,
        "test",
        "Run all tests that need nothing but Rust and MuJoCo, and list what that leaves out",
    ),
    command(Xtask, "ci", "Run what continuous integration runs: `test`, and then what needs more"),
];

const fn command(program: Program, name: &'static str, about: &'static str) -> Listed {
    Listed { program, name, about }
}

/// Returns the command of a name.
#[must_use]
pub fn find(name: &str) -> Option<Listed> {
    COMMANDS.into_iter().find(|command| command.name == name)
}

/// Returns the commands of a program.
pub fn of(program: Program) -> impl Iterator<Item = Listed> {
    COMMANDS.into_iter().filter(move |command| command.program == program)
}
