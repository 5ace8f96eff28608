//! A check and the line that shows it.

use std::fmt::Display;

use super::json::Metric;

/// A claim that was checked.
#[derive(Clone, Debug)]
pub struct Check {
    /// Its path, such as `FetchReach-v4/reward/sparse`.
    pub name: String,
    /// Whether it holds.
    pub passed: bool,
    /// What was seen, in words.
    pub seen: String,
    /// What was measured.
    pub figure: Metric,
}

impl Check {
    /// Returns a check that passes if there are no faults; its figure is their number.
    pub fn none_of(name: impl Display, faults: usize, seen: impl Display) -> Self {
        Self::new(name, faults == 0, seen, Metric::count(faults))
    }

    /// Returns a check.
    pub fn new(name: impl Display, passed: bool, seen: impl Display, figure: Metric) -> Self {
        Self { name: name.to_string(), passed, seen: seen.to_string(), figure }
    }

    /// Returns a check of a statistical test, which passes if its p-value is not below `least`.
    pub fn of_test(name: impl Display, p: f64, least: f64, seen: impl Display) -> Self {
        Self::new(name, p >= least, seen, Metric::new(p, "1"))
    }
}

/// Returns the first word of a line.
pub const fn mark(passed: bool) -> &'static str {
    if passed { "ok  " } else { "FAIL" }
}

/// Prints checks below a heading, one per line.
///
/// # Errors
/// Standard output is closed or full.
pub fn print(heading: &str, checks: &[Check]) -> anyhow::Result<()> {
    say!("{heading}")?;
    for Check { name, passed, seen, .. } in checks {
        say!("  {}  {name:<46}  {seen}", mark(*passed))?;
    }
    Ok(())
}
