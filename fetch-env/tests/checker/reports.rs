//! The checker's reports.

use fetch_env::{
    FetchConfig, FetchEnv, KinematicEnv, KinematicSimulator, RewardKind, Task,
    check::{CheckOptions, CheckReport, check_env, check_goal_env},
    make_kinematic,
};

use crate::{check, faulty::Fault};

const EVERY_ENV: &str = "\
ok   spaces/action                [4] numbers within [-1, 1]
ok   order/step-before-reset      it asks for a reset
ok   order/bad-actions            18 refused, the 60 steps after them unchanged
ok   reset/in-space               it lies in its space
ok   reset/deterministic          equal to the last bit, in two environments; the stream continues
ok   reset/unseeded               two environments start differently
ok   reset/options                the default ones change nothing
ok   step/in-space                60 steps
ok   step/deterministic           60 steps, twice and in another environment, equal to the last bit
ok   end/step-after-end           it asks for a reset after step 50
";

const EVERY_GOAL_ENV: &str = "\
ok   reset/seeds-differ           10 seeds, 10 goals
ok   spaces/observation           [25] numbers, goals of [3]
ok   goal/constant                60 steps
ok   goal/reward-law              60 steps, bit for bit
ok   goal/any-goal                100 pairs, singly and batched
ok   goal/bad-goals               22 pairs refused
ok   goal/info                    60 steps, 0 of them successes
ok   end/laws                     60 steps, 0 terminated and 1 truncated episodes
ok   end/limit                    truncated at step 50, not before
";

const EVERY_SNAPSHOT: &str = "\
ok   snapshot/replay              60 steps, from 4 places
ok   snapshot/other-environment   60 steps, from 4 places
ok   snapshot/hidden-state        none seen, from 30 places
ok   snapshot/before-reset        a reset is needed again
";

#[test]
fn a_report_says_what_was_checked() {
    let (make, options) = (|| Ok(make_kinematic("FetchPushDense-v4")?), CheckOptions::default());
    let report = check_goal_env(make, &options);
    assert_eq!(report.to_string(), [EVERY_ENV, EVERY_GOAL_ENV, EVERY_SNAPSHOT].concat());
    let others = "\
ok   reset/seeds-differ           10 seeds, 10 starts
ok   end/limit                    the episode ended at step 50 of at most 50
";
    assert_eq!(check_env(make, &options).to_string(), [EVERY_ENV, others].concat());
}

#[test]
fn a_report_says_how_episodes_went() {
    let at_once = "not reached: the episode ended by its own rules at 1";
    for (fault, ends) in [
        (Fault::TerminatesAtOnce, "60 steps, 60 terminated and 0 truncated episodes"),
        (Fault::TruncatesAtOnce, "60 steps, 0 terminated and 60 truncated episodes"),
    ] {
        let report = check(fault);
        assert_eq!(message(&report, "end/laws"), ends);
        assert_eq!(message(&report, "end/limit"), at_once);
    }
    let always_successful = || -> Result<KinematicEnv, _> {
        let config =
            FetchConfig::new(Task::Push, RewardKind::Sparse).with_distance_threshold(10.0)?;
        let simulator = KinematicSimulator::new(config.sim());
        Ok(FetchEnv::new(config, simulator)?.time_limited())
    };
    let report = check_goal_env(always_successful, &CheckOptions::default());
    assert_eq!(message(&report, "goal/info"), "60 steps, 60 of them successes");
}

#[test]
fn a_report_says_what_is_wrong() {
    let report = check(Fault::WideActionSpace);
    let failure = report.failures().next().expect("a failure");
    let expected = "FAIL spaces/action                \
                    element 0 is between -2 and 2, not symmetric within [-1, 1]";
    assert_eq!(failure.to_string(), expected);
}

fn message<'r>(report: &'r CheckReport, name: &str) -> &'r str {
    let check = report.checks.iter().find(|check| check.name == name);
    &check.expect("a check of this name").message
}
