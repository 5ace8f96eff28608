//! The environment checker: does an environment keep the laws that its users rely on?
//!
//! It covers every property that Gymnasium's `check_env` and Stable-Baselines3's goal checks test
//! and that Rust's types do not already guarantee, and some that those two do not test.

mod calls;
mod goals;
mod replay;
mod report;
mod same;
mod subject;

use self::{
    report::Outcome,
    subject::{Checked, Subject},
};
pub use self::{
    report::{Check, CheckReport},
    same::same_bits,
    subject::CheckOptions,
};
use crate::gym::env::observation::BatchObservation;
use crate::gym::env::{Env, SnapshotEnv, goal::GoalEnv};
use crate::gym::error::EnvError;

type Law<E> = fn(&Subject<'_, E>) -> Outcome;

/// Returns the laws of goal-conditioned and of other environments.
fn laws<E: Checked>() -> [(&'static str, Law<E>); 10] {
    [
        ("spaces/action", calls::action_space),
        ("order/step-before-reset", calls::step_before_reset),
        ("order/bad-actions", calls::bad_actions),
        ("reset/in-space", replay::reset_in_space),
        ("reset/deterministic", replay::reset_is_deterministic),
        ("reset/unseeded", replay::unseeded),
        ("reset/options", replay::default_options),
        ("step/in-space", replay::step_in_space),
        ("step/deterministic", replay::step_is_deterministic),
        ("end/step-after-end", calls::step_after_end),
    ]
}

/// Checks the laws of every environment.
///
/// `make` makes an environment at every call, always the same way: some laws are about two
/// environments, or about one that has never been reset.
///
/// ```
/// use fetch_env::{check::{CheckOptions, check_env, check_snapshots}, make_kinematic};
///
/// let (make, options) = (|| Ok(make_kinematic("FetchReach-v4")?), CheckOptions::default());
/// let report = check_env(make, &options).and(check_snapshots(make, &options));
/// assert!(report.passed(), "{report}");
/// ```
pub fn check_env<E: Env<Observation: BatchObservation>>(
    make: impl Fn() -> Result<E, EnvError>,
    options: &CheckOptions,
) -> CheckReport {
    let checks: [(&str, Law<E>); 2] =
        [("reset/seeds-differ", replay::seeds_differ), ("end/limit", replay::limit)];
    run(laws().into_iter().chain(checks), &Subject { make: &make, options })
}

/// Checks the laws of a goal-conditioned environment: those of [`check_goals`] and of
/// [`check_snapshots`].
pub fn check_goal_env<E: GoalEnv + SnapshotEnv>(
    make: impl Fn() -> Result<E, EnvError>,
    options: &CheckOptions,
) -> CheckReport {
    check_goals(&make, options).and(check_snapshots(&make, options))
}

/// Checks the laws of a goal-conditioned environment that need no snapshots: those of [`check_env`]
/// and those of goals and rewards.
pub fn check_goals<E: GoalEnv>(
    make: impl Fn() -> Result<E, EnvError>,
    options: &CheckOptions,
) -> CheckReport {
    let checks: [(&str, Law<E>); 9] = [
        ("reset/seeds-differ", goals::seeds_differ),
        ("spaces/observation", calls::observation_space),
        ("goal/constant", goals::constant),
        ("goal/reward-law", goals::reward_law),
        ("goal/any-goal", goals::any_goal),
        ("goal/bad-goals", goals::bad_goals),
        ("goal/info", goals::info),
        ("end/laws", goals::end_laws),
        ("end/limit", goals::limit),
    ];
    run(laws().into_iter().chain(checks), &Subject { make: &make, options })
}

/// Checks that restored snapshots give the same results again, so that nothing that an episode
/// changes lies beside them.
pub fn check_snapshots<E: SnapshotEnv<Observation: BatchObservation>>(
    make: impl Fn() -> Result<E, EnvError>,
    options: &CheckOptions,
) -> CheckReport {
    let checks: [(&str, Law<E>); 4] = [
        ("snapshot/replay", |subject| replay::snapshot(subject, Ok)),
        ("snapshot/other-environment", |subject| replay::snapshot(subject, |_| subject.env())),
        ("snapshot/hidden-state", replay::hidden_state),
        ("snapshot/before-reset", replay::snapshot_before_reset),
    ];
    run(checks, &Subject { make: &make, options })
}

fn run<E>(
    checks: impl IntoIterator<Item = (&'static str, Law<E>)>,
    subject: &Subject<'_, E>,
) -> CheckReport {
    let mut report = CheckReport::default();
    for (name, check) in checks {
        report.add(name, check(subject));
    }
    report
}
