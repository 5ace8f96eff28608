//! A check and how it is shown: one line with its figure.

use std::fmt::Display;

use crate::report::Figure;

/// One thing that was verified.
#[derive(Clone, Debug)]
pub struct Check {
    /// Slash path, such as `FetchReach-v4/reward/sparse`.
    pub name: String,
    /// Whether it holds.
    pub passed: bool,
    /// What was seen, in words.
    pub seen: String,
    /// The figure behind it.
    pub figure: Figure,
}

impl Check {
    /// A check whose figure is a count of faults: it passes if there is none.
    pub fn none_of(name: impl Display, faults: usize, seen: impl Display) -> Self {
        Self::new(name, faults == 0, seen, Figure::count(faults))
    }

    /// A check with a figure of its own.
    pub fn new(name: impl Display, passed: bool, seen: impl Display, figure: Figure) -> Self {
        Self { name: name.to_string(), passed, seen: seen.to_string(), figure }
    }

    /// The check as a line.
    pub fn line(&self) -> String {
        let mark = if self.passed { "ok  " } else { "FAIL" };
        format!("{mark}  {:<46}  {}", self.name, self.seen)
    }
}

/// Prints a heading and its checks.
pub fn print(heading: &str, checks: &[Check]) {
    println!("{heading}");
    for check in checks {
        println!("  {}", check.line());
    }
}
