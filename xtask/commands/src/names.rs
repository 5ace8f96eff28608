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

/// A command in the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Listed {
    /// The program that has it.
    pub program: Program,
    /// Its name, the first argument.
    pub name: &'static str,
    /// What it does, in a line.
    pub about: &'static str,
}

/// Declares the commands of each program.
macro_rules! commands {
    ($($program:ident { $($name:literal: $about:literal,)* })*) => {
        /// All commands of `cargo xtask`, in the order in which its help lists them.
        pub const COMMANDS: &[Listed] = &[
            $($(Listed { program: Program::$program, name: $name, about: $about },)*)*
        ];
    };
}

commands! {
    Chapter {
        "verify": "Verify every claim of the chapter by stepping the environments",
        "bridge": "Compare hand-computed rewards with the environment's, step by step",
        "describe": "Write the observation and action spaces as JSON",
        "reward-check": "Check that step, compute_reward and the distance formula agree",
        "random-episodes": "Run a random policy and write its results as JSON",
        "all": "Run describe, reward-check and random-episodes",
        "exercise": "Answer one of the chapter's exercises, 1 to 4",
        "doctor": "Look for the usual problems, and say how to fix them",
        "task-pages": "Write a page for each task from the tables in the code",
    }
    Lab {
        "parity": "Compare with the real environment: recorded, live, pictures, samples, policies",
        "bench": "Measure speed and memory",
        "figures": "Draw the chapter's figures, and Slide's",
        "report": "Write one page with checks, baselines, plots and playbacks",
        "play": "Write a page that plays one episode back",
        "plan": "Plan episodes on exact snapshots: how much of a task can be solved at all",
        "collect": "Run a policy, and save its episodes",
        "datasets": "Write data sets of all environments, for Minari and OGBench",
        "train": "Train a policy, with its learning curve and a page",
        "learning-curves": "Report when runs reached their targets, and plot their curves",
        "soak": "Step, save and render environments for a long time, and look for leaks",
    }
    Xtask {
        "assets": "Fetch the reference's model into the cache",
        "mujoco": "Fetch another version of MuJoCo into the cache",
        "fuzz": "Fuzz loading, and sequences of calls to the replay buffer and to environments",
        "sanitize": "Run tests under sanitizers, Valgrind and Miri",
        "mutants": "Change the code in small ways, and check that a test fails",
        "packages": "Check that the crates are ready to be published",
        "platforms": "Build and test the crates for other systems and processors",
        "projects": "Test projects that depend on the crates, one of them made from the README",
        "python": "Build the Python package, and test it beside the reference",
        "test": "Run all tests that need only Rust and MuJoCo, and list what was left out",
        "ci": "Run what continuous integration runs: `test`, then everything that needs more",
    }
}

/// Returns the command with this name.
#[must_use]
pub fn find(name: &str) -> Option<Listed> {
    COMMANDS.iter().copied().find(|command| command.name == name)
}

/// Returns the commands of a program.
pub fn of(program: Program) -> impl Iterator<Item = Listed> {
    COMMANDS.iter().copied().filter(move |command| command.program == program)
}
