//! The laws of the strategies that look beyond an episode, and of mixtures.

use crate::common::{
    Result, Telling, add, assert_distribution, assert_uniform, buffer, draw, relabel_all,
};
use her_relabel::{
    Batch, GoalMixture, GoalPart, GoalStrategy, HerBuffer, MixtureError, Sampler, UnitInterval,
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
fn random_goals_are_uniform_over_the_buffer_whatever_the_transition() -> Result {
    let mut counts = vec![0; 100];
    for row in draw(&three_episodes(), &relabel_all(50_000, GoalStrategy::Random), 1) {
        let id = row.id as usize - 1;
        let goal = (row.id as i64 + row.ahead.unwrap()) as usize - 1;
        let (episode, state) = row.new_goal.unwrap();
        // The source is the transition that leads to the goal's state.
        assert_eq!(goal, [0, 2, 7][episode as usize - 1] + state as usize - 1);
        counts[id * 10 + goal] += 1;
    }
    assert_uniform(&counts, "transition and goal");
    Ok(())
}

#[test]
fn past_goals_were_desired_as_often_as_they_were_pursued() -> Result {
    let sampler = relabel_all(30_000, GoalStrategy::PastDesired);
    let mut batch = Batch::<f64>::new();
    sampler.sample(&three_episodes(), &Telling, 2, &mut batch)?;
    let mut counts = [0; 3];
    for (row, goal) in batch.desired_goal().chunks_exact(3).enumerate() {
        let episode = goal[0] as u32;
        assert_eq!(goal, crate::common::desired_goal(episode));
        let source = batch.goal_source()[row].unwrap().get();
        assert!([1..=2, 3..=7, 8..=10][episode as usize - 1].contains(&source));
        counts[episode as usize - 1] += 1;
    }
    assert_distribution(&counts, &[0.2, 0.5, 0.3], "past desired goals");
    Ok(())
}

#[test]
fn geometric_goals_are_as_likely_as_gamma_says() -> Result {
    const LEN: u32 = 8;
    let mut buffer = buffer(100);
    add(&mut buffer, 1, LEN, (false, true));
    for gamma in [0.0, 0.3, 0.9, 1.0] {
        let strategy = GoalStrategy::Geometric { gamma: UnitInterval::new(gamma)? };
        let drawn = draw(&buffer, &relabel_all(40_000, strategy), 3);
        for t in 0..LEN {
            let left = (LEN - t) as usize;
            let mut counts = vec![0; left];
            for row in drawn.iter().filter(|row| row.t == t) {
                counts[(row.new_goal.unwrap().1 - t - 1) as usize] += 1;
            }
            let weights: Vec<f64> = (0..left as i32).map(|ahead| gamma.powi(ahead)).collect();
            let total: f64 = weights.iter().sum();
            let shares: Vec<f64> = weights.iter().map(|weight| weight / total).collect();
            if gamma == 0.0 {
                assert_eq!(counts[1..].iter().sum::<u64>(), 0);
            } else {
                assert_distribution(&counts, &shares, &format!("gamma {gamma}, step {t}"));
            }
        }
    }
    Ok(())
}

#[test]
fn a_mixture_uses_its_strategies_as_often_as_they_weigh() -> Result {
    let part = GoalPart::new;
    let goals = GoalMixture::new(&[
        part(GoalStrategy::Final, 3.0),
        part(GoalStrategy::Random, 0.0),
        part(GoalStrategy::PastDesired, 1.0),
    ])?;
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 6, (false, true));
    let sampler =
        Sampler::new(20_000, GoalStrategy::Future, UnitInterval::from_k(1)).with_goals(goals);
    let mut batch = Batch::<f64>::new();
    sampler.sample(&buffer, &Telling, 4, &mut batch)?;
    let mut counts = [0; 3];
    for (goal, relabeled) in batch.desired_goal().chunks_exact(3).zip(batch.relabeled()) {
        counts[match (relabeled, goal[1]) {
            (false, _) => 0,
            (true, 6.0) => 1,
            (true, -1.0) => 2,
            other => panic!("{other:?} is no goal of these strategies"),
        }] += 1;
    }
    assert_distribution(&counts, &[0.5, 0.375, 0.125], "own, final, past");
    Ok(())
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
