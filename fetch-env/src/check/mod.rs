//! The environment checker: does an environment keep the laws that its users rely upon?
//!
//! It holds every property of Gymnasium's `check_env` and of Stable-Baselines3's goal checks that
//! is not already kept by Rust's types, and some that those do not look at.

mod end;
mod goal;
mod order;
mod report;
mod reset;
mod snapshot;
mod space;
mod step;
mod subject;

use std::num::NonZeroU32;

pub use report::{Check, CheckReport};
use serde::{Deserialize, Serialize};
use subject::Subject;

use crate::{EnvError, GoalEnv, SnapshotEnv};

/// How an environment is checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CheckOptions {
    /// Seed of the episodes, and of the actions by a stream of its own.
    pub seed: u64,
    /// Random steps in each of the checks that step. More than an episode has, so that resets
    /// without a seed are among them.
    pub steps: u32,
    /// Steps after which the environment should truncate an episode; `None` if only its own rules
    /// should.
    pub max_episode_steps: Option<NonZeroU32>,
}

impl Default for CheckOptions {
    fn default() -> Self {
        Self { seed: 0, steps: 60, max_episode_steps: NonZeroU32::new(50) }
    }
}

/// Checks what can be said of every goal-conditioned environment.
///
/// `make` makes one environment as often as it is called, always the same way: some laws are about
/// two environments, or about one that has never been reset.
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
    let subject = Subject { make, options };
    let mut report = CheckReport::default();
    report.run("spaces/action", || space::action_space(&subject));
    report.run("spaces/observation", || space::observation_space(&subject));
    report.run("order/step-before-reset", || order::step_before_reset(&subject));
    report.run("order/bad-actions", || order::bad_actions(&subject));
    report.run("reset/in-space", || reset::in_space(&subject));
    report.run("reset/deterministic", || reset::deterministic(&subject));
    report.run("reset/seeds-differ", || reset::seeds_differ(&subject));
    report.run("reset/unseeded", || reset::unseeded(&subject));
    report.run("reset/options", || reset::default_options(&subject));
    report.run("step/in-space", || step::in_space(&subject));
    report.run("step/deterministic", || step::deterministic(&subject));
    report.run("goal/constant", || goal::constant(&subject));
    report.run("goal/reward-law", || goal::reward_law(&subject));
    report.run("goal/any-goal", || goal::any_goal(&subject));
    report.run("goal/bad-goals", || goal::bad_goals(&subject));
    report.run("goal/info", || goal::info(&subject));
    report.run("end/laws", || end::laws(&subject));
    report.run("end/limit", || end::limit(&subject));
    report.run("end/step-after-end", || end::step_after_end(&subject));
    report
}

/// [`check_env`], and whether going back to a snapshot gives the same results again.
pub fn check_snapshot_env<E: GoalEnv + SnapshotEnv>(
    make: impl Fn() -> Result<E, EnvError>,
    options: &CheckOptions,
) -> CheckReport {
    let mut report = check_env(&make, options);
    let subject = Subject { make, options };
    report.run("snapshot/replay", || snapshot::replay(&subject));
    report.run("snapshot/other-environment", || snapshot::other_environment(&subject));
    report.run("snapshot/before-reset", || snapshot::before_reset(&subject));
    report
}
