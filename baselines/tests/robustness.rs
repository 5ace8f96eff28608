//! Curves of robustness, and what they are summarized by.

use baselines::robustness::{RobustnessCurve, SuccessAt};
use baselines::{
    Episode, Estimate, Evaluation, EvaluationError, ProportionalPolicy, ScriptedPolicy, evaluate,
};
use fetch_env::variation::Variation;
use fetch_env::{FetchConfig, FetchEnv, KinematicSimulator, RewardKind, Task};
use testing::Result;

/// Returns 100 episodes of which a number succeeds at the end, and twice as many at any time.
fn episodes(successes: usize) -> Evaluation {
    let episode = |number| Episode {
        seed: None,
        episode_return: -1.0,
        episode_length: 50,
        final_distance: 0.1,
        success: number < successes,
        success_any: number < 2 * successes,
        controls: None,
    };
    Evaluation { episodes: (0..100).map(episode).collect() }
}

#[test]
fn a_published_curve_has_the_published_summaries() -> Result {
    // Push under noise of its observations, in percent.
    let published =
        [(0.0, 100), (0.005, 98), (0.01, 97), (0.02, 94), (0.05, 11), (0.1, 5), (0.2, 5)];
    let values = published.map(|(value, _)| value);
    let curve = RobustnessCurve::measure("observation_noise", &values, |value| {
        let (_, successes) = published[values.iter().position(|&v| v == value).unwrap_or(0)];
        Ok::<_, EvaluationError>(episodes(successes))
    })?;
    assert_eq!(curve.critical_value(SuccessAt::End, 0.5), Some(0.05));
    assert_eq!(curve.critical_value(SuccessAt::End, 0.05), None);
    assert!((curve.area(SuccessAt::End) - 0.044).abs() < 0.0005, "{}", curve.area(SuccessAt::End));
    let slope = curve.slope(SuccessAt::End);
    assert!((-5.45..=-5.30).contains(&slope), "{slope}");
    let any: Vec<_> = curve.rates(SuccessAt::AnyTime).map(|(_, rate)| rate.value).collect();
    assert_eq!(any[4..], [0.22, 0.10, 0.10]);
    // Of two seeds, of which one always fails.
    let failing = |_| Ok::<_, EvaluationError>(episodes(0));
    let curves = [curve, RobustnessCurve::measure("observation_noise", &values, failing)?];
    let means = RobustnessCurve::mean_rates(&curves, SuccessAt::End)?;
    assert_eq!(means[1].0, 0.005);
    let Estimate { value, low, high } = means[1].1;
    assert_eq!((value, low, high), (0.49, 0.0, 1.0));
    assert!(means[6].1.high > 0.2 && means[6].1.low == 0.0);
    assert!(RobustnessCurve::mean_rates(&[], SuccessAt::End).is_err());
    Ok(())
}

#[test]
fn a_controller_fails_when_it_sees_nothing_but_noise() -> Result {
    let measure = |noise: f64| -> Result<_> {
        let variation = Variation::default().with("observation_noise", noise)?;
        let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_variation(variation);
        let simulator = KinematicSimulator::new(config.sim());
        let mut env = FetchEnv::new(config, simulator)?.time_limited();
        Ok(evaluate(&mut env, &mut ScriptedPolicy::new(Task::Push), 50, 0, |_| ())?)
    };
    let curve = RobustnessCurve::measure("observation_noise", &[0.0, 0.3], measure)?;
    let rates: Vec<_> = curve.rates(SuccessAt::End).map(|(_, rate)| rate.value).collect();
    assert!(rates[0] > 0.9 && rates[1] < 0.5, "{rates:?}");
    Ok(())
}

#[test]
fn a_proportional_controller_solves_reach_at_any_gain_and_never_pushes() -> Result {
    for task in Task::ALL {
        let config = FetchConfig::new(task, RewardKind::Sparse);
        let mut env =
            FetchEnv::new(config.clone(), KinematicSimulator::new(config.sim()))?.time_limited();
        for gain in [5.0, 10.0, 20.0] {
            let mut policy = ProportionalPolicy::new(task).with_gain(gain);
            let summary = evaluate(&mut env, &mut policy, 50, 0, |_| ())?.summary()?;
            let rate = summary.success_rate.value;
            assert!(if task == Task::Reach { rate == 1.0 } else { rate < 0.5 }, "{task}: {rate}");
        }
    }
    Ok(())
}
