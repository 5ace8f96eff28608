//! The names of the commands that xtask hands on, and their one-line descriptions. The tests of
//! each package compare its list with its commands.

/// The commands of the package `chapter`, which builds without the learner, plots and archives.
pub const OF_CHAPTER: [(&str, &str); 8] = [
    ("verify", "Verify every claim of the chapter by stepping the environments"),
    ("bridge", "Compare hand-computed rewards with the environment's, step by step"),
    ("describe", "Write the observation and action spaces as JSON"),
    ("reward-check", "Check that step, compute_reward and the distance formula agree"),
    ("random-episodes", "Run a random policy and write its results as JSON"),
    ("all", "Run describe, reward-check and random-episodes"),
    ("exercise", "Answer one of the chapter's exercises, 1 to 4"),
    ("doctor", "Look for the usual problems, and say how to fix them"),
];

/// The commands of the package `lab`.
pub const OF_LAB: [(&str, &str); 9] = [
    ("parity", "Replay recordings of the real environment and compare"),
    ("bench", "Measure speed and memory"),
    ("figures", "Draw the chapter's pictures, and Slide's"),
    ("report", "Write one page with checks, baselines, plots and playbacks"),
    ("play", "Write a page that plays one episode back"),
    ("collect", "Run a policy, and save its episodes"),
    ("train", "Train a policy, with its learning curve and a page"),
    ("learning-curves", "Gather runs, tell when they reached their targets, and draw their curves"),
    (
        "soak",
        "Step, save and draw environments for a long time, and look for what they leave behind",
    ),
];
