//! The environment checker: does an environment keep the laws that its users rely on?
//!
//! It covers every property that Gymnasium's `check_env` and Stable-Baselines3's goal checks test
//! and that Rust's types do not already guarantee, and some that those two do not test.

mod calls;
mod goals;
mod replay;
mod report;
mod subject;

use self::{report::Outcome, subject::Subject};
pub use self::{
    report::{Check, CheckReport},
    subject::{CheckOptions, same_bits},
};
use crate::env::{SnapshotEnv, goal::GoalEnv};
use crate::error::EnvError;

type Law<E> = fn(&Subject<'_, E>) -> Outcome;

/// Checks the laws of every goal-conditioned environment.
///
/// `make` makes an environment at every call, always the same way: some laws are about two
/// environments, or about one that has never been reset.
///
/// ```
/// use fetch_env::{check::{CheckOptions, check_env}, make_kinematic};
///
/// let report = check_env(|| make_kinematic("FetchReach-v4"), &CheckOptions::default());
/// assert!(report.passed(), "{report}");
/// ```
pub fn check_env<E: GoalEnv>(
    make: impl Fn() -> Result<E, EnvError>,
    options: &CheckOptions,
) -> CheckReport {
    let subject = Subject { make: &make, options };
    let checks: [(&str, Law<E>); 19] = [
        ("spaces/action", calls::action_space),
        ("spaces/observation", calls::observation_space),
        ("order/step-before-reset", calls::step_before_reset),
        ("order/bad-actions", calls::bad_actions),
        ("reset/in-space", replay::reset_in_space),
        ("reset/deterministic", replay::reset_is_deterministic),
        ("reset/seeds-differ", replay::seeds_differ),
        ("reset/unseeded", replay::unseeded),
        ("reset/options", replay::default_options),
        ("step/in-space", replay::step_in_space),
        ("step/deterministic", replay::step_is_deterministic),
        ("goal/constant", goals::constant),
        ("goal/reward-law", goals::reward_law),
        ("goal/any-goal", goals::any_goal),
        ("goal/bad-goals", goals::bad_goals),
        ("goal/info", goals::info),
        ("end/laws", goals::end_laws),
        ("end/limit", goals::limit),
        ("end/step-after-end", goals::step_after_end),
    ];
    let mut report = CheckReport::default();
    for (name, check) in checks {
        report.add(name, check(&subject));
    }
    report
}

/// Runs [`check_env`], and checks that a restored snapshot gives the same results again.
pub fn check_snapshot_env<E: GoalEnv + SnapshotEnv>(
    make: impl Fn() -> Result<E, EnvError>,
    options: &CheckOptions,
) -> CheckReport {
    let mut report = check_env(&make, options);
    let subject = Subject { make: &make, options };
    report.add("snapshot/replay", replay::snapshot(&subject, Ok));
    report.add("snapshot/other-environment", replay::snapshot(&subject, |_| make()));
    report.add("snapshot/before-reset", replay::snapshot_before_reset(&subject));
    report
}
