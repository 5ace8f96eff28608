//! Mixtures of strategies.

use crate::common::{Result, add, buffer, draw, relabel_all};
use her_relabel::{
    GoalMixture, GoalPart, GoalStrategy, HerBuffer, MixtureError, Sampler, UnitInterval,
};
use proptest::prelude::*;

/// Episodes 1, 2 and 3 of 2, 5 and 3 steps.
fn three_episodes() -> HerBuffer<f64> {
    let mut buffer = buffer(100);
    for (episode, len) in [(1, 2), (2, 5), (3, 3)] {
        add(&mut buffer, episode, len, (false, true));
    }
    buffer
}

#[test]
fn a_mixture_of_one_is_that_strategy() -> Result {
    let sampler = relabel_all(100, GoalStrategy::Episode);
    let part = GoalPart::new(GoalStrategy::Episode, 0.25);
    let mixed = sampler.with_goals(GoalMixture::new(&[part])?);
    assert_eq!(draw(&three_episodes(), &sampler, 5), draw(&three_episodes(), &mixed, 5));
    Ok(())
}

#[test]
fn weights_that_make_no_mixture_are_refused() {
    let part = |weight| GoalPart::new(GoalStrategy::Future, weight);
    assert_eq!(GoalMixture::new(&[]), Err(MixtureError::PartCount { count: 0 }));
    assert_eq!(GoalMixture::new(&[part(1.0); 7]), Err(MixtureError::PartCount { count: 7 }));
    assert_eq!(GoalMixture::new(&[part(-1.0)]), Err(MixtureError::BadWeight { weight: -1.0 }));
    assert!(GoalMixture::new(&[part(1.0), part(f64::NAN)]).is_err());
    assert_eq!(GoalMixture::new(&[part(0.0)]), Err(MixtureError::BadTotal { total: 0.0 }));
    assert!(GoalMixture::new(&[part(f64::MAX); 2]).is_err());
    assert!(UnitInterval::new(1.1).is_err() && UnitInterval::new(f64::NAN).is_err());
}

proptest! {
    #[test]
    fn a_sampler_survives_serialization(weights in prop::collection::vec(0.1_f64..9.0, 1..6)) {
        let part = |(at, weight): (usize, f64)| {
            GoalPart::new([GoalStrategy::Random, GoalStrategy::PastDesired][at % 2], weight)
        };
        let parts: Vec<GoalPart> = weights.into_iter().enumerate().map(part).collect();
        let sampler =
            relabel_all(9, GoalStrategy::Final).with_goals(GoalMixture::new(&parts).unwrap());
        let text = serde_json::to_string(&sampler).unwrap();
        prop_assert_eq!(serde_json::from_str::<Sampler>(&text).unwrap(), sampler);
    }
}
