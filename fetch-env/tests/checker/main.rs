//! The checker can fail: the check of each law finds the faults against it.

mod faulty;
mod parts;
mod reports;

use fetch_env::check::{CheckOptions, CheckReport, check_goal_env};

use faulty::{Fault, Faulty};

/// The faults, and the checks that must find them.
const FAULTS: [(Fault, &[&str]); 38] = [
    (Fault::WideActionSpace, &["spaces/action"]),
    (Fault::LopsidedActionSpace, &["spaces/action"]),
    (Fault::ClosedActionSpace, &["spaces/action"]),
    (Fault::EmptyActionSpace, &["spaces/action"]),
    (Fault::RefusesItsSamples, &["spaces/action"]),
    (Fault::MissingKey, &["spaces/observation"]),
    (Fault::GoalsOfTwoShapes, &["spaces/observation"]),
    (Fault::GoalsInSinglePrecision, &["spaces/observation"]),
    (Fault::GoalsOfOneValue, &["spaces/observation"]),
    (Fault::StepsBeforeReset, &["order/step-before-reset", "snapshot/before-reset"]),
    (Fault::TakesNan, &["order/bad-actions"]),
    (Fault::TakesAnyLength, &["order/bad-actions"]),
    (Fault::BadActionsMove, &["order/bad-actions"]),
    (Fault::ShortObservation, &["reset/in-space", "step/in-space"]),
    (Fault::IgnoresTheSeed, &["reset/deterministic", "step/deterministic"]),
    (Fault::RestartsTheStream, &["reset/deterministic"]),
    (Fault::KnowsOneSeed, &["reset/seeds-differ"]),
    (Fault::UnseededIsZero, &["reset/unseeded"]),
    (Fault::DefaultsMatter, &["reset/options"]),
    (Fault::NanReward, &["step/in-space"]),
    (Fault::RemembersEpisodes, &["step/deterministic"]),
    (Fault::MovesTheGoal, &["goal/constant"]),
    (Fault::RewardOffByABit, &["goal/reward-law"]),
    (Fault::BatchOffByABit, &["goal/any-goal"]),
    (Fault::OnlyMissesSucceed, &["goal/any-goal"]),
    (Fault::TakesBadGoals, &["goal/bad-goals"]),
    (Fault::LiesAboutSuccess, &["goal/info"]),
    (Fault::LiesAboutDistance, &["goal/info"]),
    (Fault::VariesTheInfo, &["reset/deterministic", "step/deterministic"]),
    (Fault::FlipsASignInTheInfo, &["step/deterministic"]),
    (Fault::Terminates, &["end/laws"]),
    (Fault::TruncatesEarly, &["end/laws", "end/limit"]),
    (Fault::TruncatesLate, &["end/laws", "end/limit"]),
    (Fault::StepsAfterTheEnd, &["end/step-after-end"]),
    (Fault::RestoresNothing, &["snapshot/replay", "snapshot/other-environment"]),
    (Fault::ForgetsTheEpisodes, &["snapshot/replay"]),
    (Fault::RestoresANewEnvironmentAsRunning, &["snapshot/before-reset"]),
    (Fault::HidesState, &["snapshot/hidden-state"]),
];

#[test]
fn a_faultless_environment_passes_every_check() {
    for harmless in
        [Fault::None, Fault::NeverSucceeds, Fault::TerminatesAtOnce, Fault::TruncatesAtOnce]
    {
        let report = check(harmless);
        assert!(report.passed(), "{harmless:?}:\n{report}");
    }
}

#[test]
fn every_fault_is_found_by_its_checks() {
    for (fault, checks) in FAULTS {
        let report = check(fault);
        assert!(!report.passed(), "nothing sees {fault:?}");
        for name in checks {
            let found = report.failures().any(|check| check.name == *name);
            assert!(found, "{name} does not see {fault:?}:\n{report}");
        }
    }
}

#[test]
fn every_check_finds_some_fault() {
    for check in check(Fault::None).checks {
        let found = FAULTS.iter().any(|(_, checks)| checks.contains(&check.name));
        assert!(found, "no fault makes {} fail", check.name);
    }
}

fn check(fault: Fault) -> CheckReport {
    let (make, options) = (|| Faulty::new(fault), CheckOptions::default());
    check_goal_env(make, &options)
}
