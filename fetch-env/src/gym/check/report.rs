//! Results of the checks.

use std::{error::Error, fmt};

use serde::Serialize;

/// The results of all checks, in the order in which they ran.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct CheckReport {
    /// All checks that apply to this kind of environment.
    pub checks: Vec<Check>,
}

/// The result of one check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Check {
    /// Name of the check, such as `reset/deterministic`.
    pub name: &'static str,
    /// Whether the environment keeps this law.
    pub passed: bool,
    /// Summary of what was checked, or of what is wrong.
    pub message: String,
}

impl CheckReport {
    /// Whether all checks passed.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.checks.iter().all(|check| check.passed)
    }

    /// Iterates over the checks that failed.
    pub fn failures(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| !check.passed)
    }

    /// Appends the checks of another report.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.checks.extend(other.checks);
        self
    }

    pub(super) fn add(&mut self, name: &'static str, outcome: Outcome) {
        let passed = outcome.is_ok();
        let message = outcome.unwrap_or_else(|Failure(message)| message);
        self.checks.push(Check { name, passed, message });
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.checks.iter().try_for_each(|check| writeln!(f, "{check}"))
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let outcome = if self.passed { "ok  " } else { "FAIL" };
        write!(f, "{outcome} {:28} {}", self.name, self.message)
    }
}

/// A summary of what was checked, or what is wrong.
pub(super) type Outcome = Result<String, Failure>;

/// Description of what is wrong.
#[derive(Debug)]
pub(super) struct Failure(String);

impl Failure {
    pub(super) fn new(message: impl Into<String>) -> Self {
        Self(message.into())
    }

    /// Says first what to do about it.
    pub(super) fn advised(self, advice: &str) -> Self {
        Self(format!("{advice} ({})", self.0))
    }
}

/// Lets `?` turn any error into a failure. For that reason [`Failure`] itself is not an [`Error`].
impl<E: Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Self(format!("an unexpected error: {error}"))
    }
}

/// Fails with a message unless `condition` holds.
pub(super) fn ensure(condition: bool, message: impl FnOnce() -> String) -> Result<(), Failure> {
    if condition { Ok(()) } else { Err(Failure(message())) }
}
