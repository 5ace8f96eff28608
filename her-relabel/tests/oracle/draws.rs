//! Where probabilities are documented, the counts of many draws fit them.
//!
//! A list of four transitions is drawn from [`DRAWS`] times: the last three steps of an episode of
//! five, and an episode of one step. Each pair of a transition and a goal is counted, so that the
//! tests see every dependence between the two as well. If the true share of any pair that should
//! have at least 1/12 differs by 2 % of itself, Pearson's statistic has a noncentrality of at least
//! 66 (`DRAWS / 12 * 0.02^2`), and with at most ten pairs, its p-value is below [`ALPHA`] with a
//! probability of more than 99 %. A bias that shifts several shares is noticed sooner. The seeds
//! are fixed, so that the outcome never changes by chance.

use her_relabel::{
    Batch, BufferConfig, Dims, EpisodeData, GoalMixture, GoalPart, GoalStrategy, HerBuffer,
    Priorities, PriorityUnit, Sampler, TransitionId, UnitInterval,
};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::rows::{Place, places};
use crate::task::Exceed;

const DRAWS: u64 = 2_000_000;
const ROWS: u64 = 10_000;

/// The least p-value.
const ALPHA: f64 = 1e-4;

/// The first transition of each episode, and the one after its last.
const EPISODES: [(usize, usize); 2] = [(0, 3), (3, 4)];
const TRANSITIONS: usize = 4;

fn episode(transition: usize) -> (usize, usize) {
    EPISODES[usize::from(transition >= 3)]
}

fn buffer(priorities: Option<Priorities>) -> HerBuffer<f32> {
    let dims = Dims { observation: 1, goal: 1, action: 1 };
    let config = BufferConfig::new(TRANSITIONS, dims).with_priorities(priorities);
    let mut buffer = HerBuffer::new(config).unwrap();
    for steps in [5, 1] {
        let states: Vec<f32> = (0..=steps).map(|t| f32::from(t as u8)).collect();
        let zeros = vec![0.0; steps];
        let data = EpisodeData {
            observation: &states,
            achieved_goal: &states,
            desired_goal: &[-1.0],
            action: &zeros,
            reward: &zeros,
            terminated: false,
            truncated: true,
            fields: &[],
        };
        buffer.add_episode(&data).unwrap();
    }
    assert_eq!((buffer.len(), buffer.num_episodes()), (TRANSITIONS, 2));
    buffer
}

/// Counts the rows of many batches by a number below `kinds`.
fn count(
    buffer: &HerBuffer<f32>,
    sampler: &Sampler,
    kinds: usize,
    kind: impl Fn(Place, bool) -> usize,
) -> Vec<u64> {
    let mut batch = Batch::<f32>::new();
    let mut counts = vec![0; kinds];
    for seed in 0..DRAWS / ROWS {
        sampler.sample(buffer, &Exceed, seed, &mut batch).unwrap();
        for (place, goal) in places(buffer, &batch).zip(batch.desired_goal()) {
            counts[kind(place, *goal < 0.0)] += 1;
        }
    }
    counts
}

fn assert_shares(counts: &[u64], shares: &[f64], what: &str) {
    assert_eq!(counts.len(), shares.len());
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{what}: shares of a whole");
    let total = counts.iter().sum::<u64>() as f64;
    let (mut statistic, mut freedom) = (0.0, -1.0);
    for (count, share) in counts.iter().zip(shares) {
        if *share == 0.0 {
            assert_eq!(*count, 0, "{what}: something impossible was drawn");
        } else {
            let expected = total * share;
            assert!(expected >= 1000.0, "{what}: too few draws to judge");
            statistic += (*count as f64 - expected).powi(2) / expected;
            freedom += 1.0;
        }
    }
    if freedom > 0.0 {
        let p = ChiSquared::new(freedom).unwrap().sf(statistic);
        assert!(p > ALPHA, "{what}: p = {p:e}, counts {counts:?}");
    }
}

/// The probability of each goal, by its source, for a transition: `TRANSITIONS` achieved goals and
/// as many desired ones.
fn goal_shares(strategy: GoalStrategy, transition: usize) -> Vec<f64> {
    let (start, end) = episode(transition);
    let mut shares = vec![0.0; 2 * TRANSITIONS];
    match strategy {
        GoalStrategy::Future => {
            shares[transition..end].fill(1.0 / (end - transition) as f64);
        }
        GoalStrategy::Final => shares[end - 1] = 1.0,
        GoalStrategy::Episode => shares[start..end].fill(1.0 / (end - start) as f64),
        GoalStrategy::Random => shares[..TRANSITIONS].fill(1.0 / TRANSITIONS as f64),
        GoalStrategy::PastDesired => shares[TRANSITIONS..].fill(1.0 / TRANSITIONS as f64),
        GoalStrategy::Geometric { gamma } => {
            let powers: Vec<f64> =
                (0..end - transition).map(|ahead| gamma.get().powi(ahead as i32)).collect();
            let total: f64 = powers.iter().sum();
            for (share, power) in shares[transition..end].iter_mut().zip(powers) {
                *share = power / total;
            }
        }
        _ => unreachable!("all strategies are known"),
    }
    shares
}

/// Counts transitions and goals together, and compares them with the documented shares.
fn assert_joint(
    buffer: &HerBuffer<f32>,
    sampler: &Sampler,
    transition_shares: [f64; TRANSITIONS],
    what: &str,
) {
    // The achieved goals by their sources, the desired ones, and none.
    const GOALS: usize = 2 * TRANSITIONS + 1;
    let counts = count(buffer, sampler, TRANSITIONS * GOALS, |place, is_desired| {
        let goal = match place.source {
            None => 2 * TRANSITIONS,
            Some(source) => source + TRANSITIONS * usize::from(is_desired),
        };
        place.transition * GOALS + goal
    });
    let mut shares = Vec::new();
    let ratio = sampler.ratio().get();
    let total: f64 = sampler.goals().parts().iter().map(|part| part.weight()).sum();
    for (transition, share) in transition_shares.into_iter().enumerate() {
        let mut goals = [0.0; GOALS];
        goals[2 * TRANSITIONS] = share * (1.0 - ratio);
        for part in sampler.goals().parts() {
            let weight = share * ratio * part.weight() / total;
            for (goal, given) in goals.iter_mut().zip(goal_shares(part.strategy(), transition)) {
                *goal += weight * given;
            }
        }
        shares.extend(goals);
    }
    assert_shares(&counts, &shares, what);
}

const EVENLY: [f64; TRANSITIONS] = [0.25; TRANSITIONS];

fn relabel(strategy: GoalStrategy) -> Sampler {
    Sampler::new(ROWS as usize, strategy, UnitInterval::ONE)
}

fn gamma(gamma: f64) -> GoalStrategy {
    GoalStrategy::Geometric { gamma: UnitInterval::new(gamma).unwrap() }
}

#[test]
fn every_strategy_draws_its_goals_with_the_documented_shares() {
    let buffer = buffer(None);
    for strategy in [
        GoalStrategy::Future,
        GoalStrategy::Final,
        GoalStrategy::Episode,
        GoalStrategy::Random,
        GoalStrategy::PastDesired,
        gamma(0.0),
        gamma(0.6),
        gamma(0.98),
        gamma(1.0),
    ] {
        assert_joint(&buffer, &relabel(strategy), EVENLY, &format!("{strategy:?}"));
    }
}

/// The words for relabeling, for the strategy and for the goal are independent.
#[test]
fn a_mixture_draws_strategies_and_goals_independently() {
    let buffer = buffer(None);
    let goals = |parts: &[(GoalStrategy, f64)]| {
        let parts: Vec<GoalPart> =
            parts.iter().map(|(strategy, weight)| GoalPart::new(*strategy, *weight)).collect();
        GoalMixture::new(&parts).unwrap()
    };
    for (what, goals) in [
        ("two", goals(&[(GoalStrategy::Future, 1.0), (GoalStrategy::PastDesired, 1.0)])),
        (
            "three",
            goals(&[
                (GoalStrategy::PastDesired, 1.0),
                (GoalStrategy::Random, 0.0),
                (GoalStrategy::Episode, 2.0),
            ]),
        ),
        ("close", goals(&[(GoalStrategy::Episode, 1.0), (GoalStrategy::Future, 1.0)])),
    ] {
        let ratio = UnitInterval::from_k(4);
        let sampler = relabel(GoalStrategy::Future).with_goals(goals).with_ratio(ratio);
        assert_joint(&buffer, &sampler, EVENLY, what);
    }
}

#[test]
fn priorities_are_the_shares_of_transitions_and_of_episodes() {
    let beta = UnitInterval::ONE;
    let sampler = relabel(GoalStrategy::Future)
        .with_priorities(beta)
        .with_ratio(UnitInterval::new(0.5).unwrap());
    for (unit, priorities, shares) in [
        (PriorityUnit::Transition, [4.0, 0.0, 1.0, 3.0], [0.5, 0.0, 0.125, 0.375]),
        // The last priority of an episode counts.
        (PriorityUnit::Episode, [0.0, 0.0, 6.0, 4.0], [0.2, 0.2, 0.2, 0.4]),
    ] {
        let mut buffer = buffer(Some(Priorities::new(unit)));
        let oldest = buffer.transition_ids().unwrap().0.get();
        let ids: Vec<TransitionId> =
            (oldest..oldest + 4).map(|number| TransitionId::new(number).unwrap()).collect();
        buffer.set_priorities(&ids, &priorities).unwrap();
        assert_joint(&buffer, &sampler, shares, &format!("{unit:?}"));
    }
}

#[test]
fn neighboring_rows_are_independent() {
    let buffer = buffer(None);
    let sampler = relabel(GoalStrategy::Episode);
    let mut batch = Batch::<f32>::new();
    // The goals of the second row are those of the first episode.
    let (_, goals) = EPISODES[0];
    let mut counts = vec![0; TRANSITIONS * TRANSITIONS * goals];
    for seed in 0..DRAWS / ROWS {
        sampler.sample(&buffer, &Exceed, seed, &mut batch).unwrap();
        let rows: Vec<Place> = places(&buffer, &batch).collect();
        for pair in rows.chunks_exact(2) {
            let goal = pair[1].source.unwrap();
            if goal < goals {
                let transitions = pair[0].transition * TRANSITIONS + pair[1].transition;
                counts[transitions * goals + goal] += 1;
            }
        }
    }
    let shares: Vec<f64> = (0..counts.len())
        .map(|at| if at / goals % TRANSITIONS < goals { 1.0 / (4.0 * 3.0 * 3.0) } else { 0.0 })
        .collect();
    assert_shares(&counts, &shares, "pairs of rows");
}
