use std::{error::Error, fmt};

use serde::Serialize;

/// What came of all checks, in the order in which they ran.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CheckReport {
    /// The checks; there are no others for this kind of environment.
    pub checks: Vec<Check>,
}

/// What came of one check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Check {
    /// Its name, such as `reset/deterministic`.
    pub name: &'static str,
    /// Whether the environment keeps this law.
    pub passed: bool,
    /// What was looked at, or what is wrong.
    pub message: String,
}

impl CheckReport {
    /// Whether all checks passed.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.checks.iter().all(|check| check.passed)
    }

    /// The checks that did not pass.
    pub fn failures(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| !check.passed)
    }

    pub(super) fn run(&mut self, name: &'static str, check: impl FnOnce() -> Outcome) {
        let (passed, message) = match check() {
            Ok(message) => (true, message),
            Err(Failure(message)) => (false, message),
        };
        self.checks.push(Check { name, passed, message });
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for check in &self.checks {
            writeln!(f, "{check}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let outcome = if self.passed { "ok  " } else { "FAIL" };
        write!(f, "{outcome} {:28} {}", self.name, self.message)
    }
}

/// A message of what was looked at, or of what is wrong.
pub(super) type Outcome = Result<String, Failure>;

/// What is wrong.
#[derive(Debug)]
pub(super) struct Failure(String);

impl Failure {
    pub(super) fn new(message: impl Into<String>) -> Self {
        Self(message.into())
    }
}

/// So that `?` turns any error into a failure; for the same reason this is no error itself.
impl<E: Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Self(format!("an unexpected error: {error}"))
    }
}

/// Fails with a message unless `condition` holds.
pub(super) fn ensure(condition: bool, message: impl FnOnce() -> String) -> Result<(), Failure> {
    if condition { Ok(()) } else { Err(Failure(message())) }
}
