//! Random worlds, in which nothing may differ from the list.

use std::num::NonZeroUsize;

use her_relabel::{
    Batch, BufferConfig, GoalMixture, GoalNoise, GoalPart, GoalStrategy, HerBuffer, JoinedGoal,
    NStep, SampleError, Sampler, Scalar, Termination, UnitInterval,
};
use proptest::prelude::*;

use crate::events::{Event, config, event};
use crate::rows::{assert_batch, assert_contents};
use crate::task::Exceed;
use crate::world::World;

fn share() -> impl Strategy<Value = UnitInterval> {
    let shares = prop::sample::select(vec![0.0, 0.25, 0.5, 0.75, 1.0]);
    shares.prop_map(|share| UnitInterval::new(share).unwrap())
}

/// Factors with which sums of small numbers are exact.
fn gamma() -> impl Strategy<Value = UnitInterval> {
    prop::sample::select(vec![0.0, 0.5, 1.0]).prop_map(|gamma| UnitInterval::new(gamma).unwrap())
}

fn part() -> impl Strategy<Value = GoalPart> {
    let strategy = prop_oneof![
        Just(GoalStrategy::Future),
        Just(GoalStrategy::Final),
        Just(GoalStrategy::Episode),
        Just(GoalStrategy::Random),
        share().prop_map(|gamma| GoalStrategy::Geometric { gamma }),
        Just(GoalStrategy::PastDesired),
    ];
    (strategy, 0..3_u8).prop_map(|(strategy, weight)| GoalPart::new(strategy, weight.into()))
}

fn goals() -> impl Strategy<Value = GoalMixture> {
    let parts = prop::collection::vec(part(), 1..4);
    parts.prop_filter_map("a mixture", |parts| GoalMixture::new(&parts).ok())
}

/// Noise that is small beside the goals, or not.
fn noise() -> impl Strategy<Value = Option<GoalNoise>> {
    let radius = prop::sample::select(vec![0.0, 1e-9, 0.04, 2.0]);
    let noise = (radius, share()).prop_map(|(radius, share)| GoalNoise::new(radius, share));
    prop::option::of(noise)
}

fn sampler() -> impl Strategy<Value = Sampler> {
    let n_step = prop::option::of((1..7_usize, gamma())).prop_map(|n_step| {
        n_step.map(|(steps, gamma)| NStep::new(NonZeroUsize::new(steps).unwrap(), gamma))
    });
    let termination = prop::sample::select(vec![
        Termination::Stored,
        Termination::StoredOrRecomputed,
        Termination::Recomputed,
    ]);
    let outcomes = (n_step, termination, any::<bool>());
    let forms = (any::<bool>(), any::<bool>());
    let draws = (1..40_usize, share(), prop::option::of(share()), share());
    let draws = (draws, noise(), any::<bool>());
    (goals(), outcomes, forms, draws).prop_map(
        |(
            goals,
            (n_step, termination, success),
            (parallel, joined),
            (draws, noise, recomputed),
        )| {
            let (size, ratio, beta, kept) = draws;
            Sampler::new(size, GoalStrategy::Future, ratio)
                .with_goals(goals)
                .with_n_step(n_step)
                .with_termination(termination)
                .with_success(success)
                .with_parallel(parallel)
                .with_joined_goal(joined.then_some(JoinedGoal::Desired))
                .with_priorities(beta)
                .with_keep_already_achieved(kept)
                .with_goal_noise(noise)
                .with_recomputed_rewards(recomputed)
        },
    )
}

/// Draws a batch and compares it with the list.
fn assert_draw<S: Scalar, B: Scalar>(world: &World, buffer: &HerBuffer<S>, sampler: &Sampler) {
    let mut batch = Batch::<B>::new();
    let list = &world.list;
    // The list cannot know where a goal was moved unless the batch says it to the last bit.
    let noise = sampler.goal_noise().filter(|_| size_of::<B>() >= size_of::<S>());
    let sampler = &sampler.with_goal_noise(noise);
    let drawn = sampler.sample(buffer, &Exceed, 7, &mut batch);
    let expected = if list.finished.is_empty() {
        Err(SampleError::NoFinishedEpisode)
    } else if sampler.priorities().is_some() && list.priorities.is_none() {
        Err(SampleError::NoPriorities)
    } else if sampler.priorities().is_some() && list.weights().iter().all(|weight| *weight == 0.0) {
        Err(SampleError::ZeroPriorities)
    } else {
        Ok(())
    };
    assert_eq!(drawn, expected);
    if drawn.is_ok() {
        assert_batch(list, buffer, sampler, &batch);
    }
}

fn live<S: Scalar, B: Scalar>(
    config: &BufferConfig,
    events: &[Event],
    samplers: &[Sampler],
    seed: u64,
) {
    let mut world = World::new(config, seed);
    let mut buffer = HerBuffer::<S>::new(config.clone()).unwrap();
    for (at, event) in events.iter().enumerate() {
        world.happen(&mut buffer, event);
        if at % 16 == 0 {
            assert_contents(&world.list, &buffer);
            assert_draw::<S, B>(&world, &buffer, &samplers[at / 16 % samplers.len()]);
        }
    }
    assert_contents(&world.list, &buffer);
    samplers.iter().for_each(|sampler| assert_draw::<S, B>(&world, &buffer, sampler));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn nothing_differs_from_a_list_of_episodes(
        config in config(),
        events in prop::collection::vec(event(), 1..120),
        samplers in prop::collection::vec(sampler(), 1..8),
        is_wide in any::<(bool, bool)>(),
        seed in any::<u64>(),
    ) {
        match is_wide {
            (false, false) => live::<f32, f32>(&config, &events, &samplers, seed),
            (false, true) => live::<f32, f64>(&config, &events, &samplers, seed),
            (true, false) => live::<f64, f32>(&config, &events, &samplers, seed),
            (true, true) => live::<f64, f64>(&config, &events, &samplers, seed),
        }
    }
}
