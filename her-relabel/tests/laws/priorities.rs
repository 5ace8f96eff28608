//! Draws by priority: their frequency, and the importance weights that correct for it.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;

use crate::common::{DIMS, Result, Telling, add, assert_distribution, rows};
use her_relabel::{
    Batch, BufferConfig, ConfigError, GoalMixture, GoalPart, GoalStrategy, HerBuffer, NStep,
    NewPriority, Priorities, PriorityError, PriorityUnit, SampleError, Sampler, TransitionId,
    UnitInterval,
};
use proptest::prelude::*;

/// Batches drawn by priority, with full correction.
fn sampler() -> Sampler {
    Sampler::new(20_000, GoalStrategy::Future, UnitInterval::ZERO)
        .with_priorities(UnitInterval::ONE)
}

fn buffer(capacity: usize, unit: PriorityUnit) -> HerBuffer<f64> {
    let config = BufferConfig::new(capacity, DIMS).with_priorities(Priorities::new(unit));
    HerBuffer::new(config).unwrap()
}

fn draw(buffer: &HerBuffer<f64>, sampler: &Sampler, seed: u64) -> Batch<f64> {
    let mut batch = Batch::<f64>::new();
    sampler.sample(buffer, &Telling, seed, &mut batch).unwrap();
    rows(&batch);
    batch
}

/// All live transitions, oldest first.
fn live(buffer: &HerBuffer<f64>) -> Vec<TransitionId> {
    let sampler = Sampler::new(40 * buffer.len(), GoalStrategy::Future, UnitInterval::ZERO);
    let mut ids = draw(buffer, &sampler, 0).transition().to_vec();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), buffer.len());
    ids
}

/// The number of draws of each live transition.
fn counts(buffer: &HerBuffer<f64>, batch: &Batch<f64>) -> Vec<u64> {
    let first = buffer.transition_ids().unwrap().0.get();
    let mut counts = vec![0; buffer.len()];
    for id in batch.transition() {
        counts[(id.get() - first) as usize] += 1;
    }
    counts
}

/// Checks the counts of positive weights, and that no other was drawn.
fn assert_shares(counts: &[u64], weights: &[f64], what: &str) {
    let total: f64 = weights.iter().sum();
    let (mut found, mut shares) = (Vec::new(), Vec::new());
    for (count, weight) in counts.iter().zip(weights) {
        if *weight == 0.0 {
            assert_eq!(*count, 0, "{what}: weight 0 was drawn");
        } else {
            found.push(*count);
            shares.push(weight / total);
        }
    }
    assert_distribution(&found, &shares, what);
}

/// A ring that has wrapped within an episode.
fn wrapped(unit: PriorityUnit) -> HerBuffer<f64> {
    let mut buffer = buffer(30, unit);
    for (episode, len) in [(1, 9), (2, 14), (3, 1), (4, 8), (5, 6)] {
        add(&mut buffer, episode, len, (false, true));
    }
    buffer
}

#[test]
fn transitions_are_drawn_as_often_as_their_priorities_say() -> Result {
    let mut buffer = wrapped(PriorityUnit::Transition);
    let ids = live(&buffer);
    let weights: Vec<f64> = (0..30_u8).map(|at| f64::from(at % 4)).collect();
    buffer.set_priorities(&ids, &weights)?;
    let batch = draw(&buffer, &sampler(), 1);
    assert_shares(&counts(&buffer, &batch), &weights, "transitions");
    for (row, id) in batch.transition().iter().enumerate() {
        // (N P)^-1 divided by the highest such number, that of priority 1.
        assert_eq!(batch.importance_weight()[row], 1.0 / buffer.priority(*id).unwrap());
    }
    let batch = draw(&buffer, &sampler().with_priorities(None), 1);
    assert_shares(&counts(&buffer, &batch), &[1.0; 30], "uniform draws from the same buffer");
    assert!(batch.importance_weight().is_empty());
    Ok(())
}

#[test]
fn episodes_are_drawn_as_often_as_their_priorities_say_and_their_steps_uniformly() -> Result {
    let mut buffer = wrapped(PriorityUnit::Episode);
    let ids = live(&buffer);
    // One live step of episode 1 is left; then come episodes of 14, 1, 8 and 6 steps.
    let episodes = [(1, 3.0), (14, 1.0), (1, 2.0), (8, 0.0), (6, 4.0)];
    let mut weights = Vec::new();
    for (len, priority) in episodes {
        let first = weights.len();
        weights.extend(vec![priority / f64::from(len); len as usize]);
        // Any transition stands for its episode.
        let last = weights.len() - 1;
        let any = if len > 8 { ids[last] } else { ids[first] };
        buffer.set_priorities(&[any], &[priority])?;
        assert_eq!(buffer.priority(ids[first]), buffer.priority(ids[last]));
    }
    let batch = draw(&buffer, &sampler(), 2);
    assert_shares(&counts(&buffer, &batch), &weights, "episodes");
    let least = 1.0 / 14.0;
    let first = ids[0].get();
    for (row, id) in batch.transition().iter().enumerate() {
        let share = weights[(id.get() - first) as usize];
        assert!((batch.importance_weight()[row] - least / share).abs() < 1e-12);
    }
    Ok(())
}

#[test]
fn importance_weights_are_the_papers() -> Result {
    let mut buffer = wrapped(PriorityUnit::Transition);
    let ids = live(&buffer);
    let priorities: Vec<f64> = (1..=30_u8).map(f64::from).collect();
    buffer.set_priorities(&ids, &priorities)?;
    let total: f64 = priorities.iter().sum();
    for beta in [0.0, 0.4, 1.0] {
        let sampler = sampler().with_batch_size(50).with_priorities(UnitInterval::new(beta)?);
        let batch = draw(&buffer, &sampler, 3);
        let raw: Vec<f64> = batch
            .transition()
            .iter()
            .map(|id| (30.0 * buffer.priority(*id).unwrap() / total).powf(-beta))
            .collect();
        let highest = raw.iter().copied().fold(0.0, f64::max);
        for (weight, raw) in batch.importance_weight().iter().zip(raw) {
            assert!((weight - raw / highest).abs() < 1e-12, "beta {beta}");
        }
        assert!(batch.importance_weight().contains(&1.0));
    }
    assert!(UnitInterval::new(f64::NAN).is_err() && UnitInterval::new(1.1).is_err());
    Ok(())
}

#[test]
fn what_is_new_has_the_highest_priority_so_far_or_the_given_one() -> Result {
    let mut by_highest = buffer(30, PriorityUnit::Transition);
    let newest = |buffer: &HerBuffer<f64>| {
        let (_, newest) = buffer.transition_ids().unwrap();
        (newest, buffer.priority(newest).unwrap())
    };
    add(&mut by_highest, 1, 3, (false, true));
    let (id, priority) = newest(&by_highest);
    assert_eq!(priority, 1.0);
    by_highest.set_priorities(&[id], &[0.25])?;
    add(&mut by_highest, 2, 3, (false, true));
    assert_eq!(newest(&by_highest).1, 1.0, "1 at least");
    by_highest.set_priorities(&[id, id], &[7.5, 0.5])?;
    assert_eq!(by_highest.priority(id), Some(0.5), "the last one counts");
    add(&mut by_highest, 3, 3, (false, true));
    assert_eq!(newest(&by_highest).1, 7.5);
    by_highest.clear();
    assert_eq!(by_highest.priority(id), None);
    add(&mut by_highest, 4, 3, (false, true));
    assert_eq!(newest(&by_highest).1, 1.0);

    let config = BufferConfig::new(30, DIMS);
    let given = config.clone().with_priorities(
        Priorities::new(PriorityUnit::Transition).with_new_priority(NewPriority::Given(0.0)),
    );
    let mut buffer = HerBuffer::<f64>::new(given)?;
    add(&mut buffer, 1, 3, (false, true));
    let result = sampler().sample(&buffer, &Telling, 0, &mut Batch::<f64>::new());
    assert_eq!(result, Err(SampleError::ZeroPriorities));
    for priority in [-1.0, f64::NAN, f64::INFINITY] {
        let config = config.clone().with_priorities(
            Priorities::new(PriorityUnit::Episode).with_new_priority(NewPriority::Given(priority)),
        );
        let refused = HerBuffer::<f64>::new(config).unwrap_err();
        assert!(matches!(refused, ConfigError::BadPriority { .. }));
    }
    Ok(())
}

#[test]
fn priorities_of_overwritten_transitions_are_ignored() -> Result {
    for unit in [PriorityUnit::Transition, PriorityUnit::Episode] {
        let mut buffer = buffer(10, unit);
        add(&mut buffer, 1, 6, (false, true));
        let old = live(&buffer);
        // Drops two of the six.
        add(&mut buffer, 2, 6, (false, true));
        let before: Vec<_> = live(&buffer).iter().map(|id| buffer.priority(*id)).collect();
        buffer.set_priorities(&old[..2], &[5.0, 6.0])?;
        assert_eq!(buffer.priority(old[1]), None);
        let after: Vec<_> = live(&buffer).iter().map(|id| buffer.priority(*id)).collect();
        assert_eq!(before, after);
        add(&mut buffer, 3, 1, (false, true));
        let newest = buffer.transition_ids().unwrap().1;
        assert_eq!(buffer.priority(newest), Some(1.0), "they do not count as the highest, either");
    }
    Ok(())
}

#[test]
fn a_learner_that_keeps_plain_numbers_sets_priorities() -> Result {
    let mut buffer = wrapped(PriorityUnit::Transition);
    let numbers: Vec<u64> = live(&buffer).iter().map(|id| id.get()).collect();
    let ids: Option<Vec<_>> = numbers.iter().map(|number| TransitionId::new(*number)).collect();
    assert_eq!(ids.as_deref(), Some(&live(&buffer)[..]));
    buffer.set_priorities(&ids.unwrap_or_default()[..1], &[7.0])?;
    assert_eq!(buffer.priority(live(&buffer)[0]), Some(7.0));
    assert_eq!(TransitionId::new(0), None);
    let never = TransitionId::new(u64::MAX).into_iter().collect::<Vec<_>>();
    let error = buffer.set_priorities(&never, &[1.0]).unwrap_err();
    assert_eq!(error, PriorityError::UnknownTransition { number: u64::MAX });
    Ok(())
}

#[test]
fn wrong_priorities_are_refused_whole() -> Result {
    let mut buffer = wrapped(PriorityUnit::Transition);
    let ids = live(&buffer);
    for bad in [-1.0, f64::NAN, f64::INFINITY, 1e300] {
        let error = buffer.set_priorities(&ids[..2], &[0.5, bad]).unwrap_err();
        assert!(matches!(error, PriorityError::BadPriority { index: 1, .. }));
    }
    let error = buffer.set_priorities(&ids, &[0.5]).unwrap_err();
    assert_eq!(error, PriorityError::WrongLength { transitions: 30, priorities: 1 });
    let mut longer = buffer.clone();
    add(&mut longer, 9, 1, (false, true));
    let foreign = longer.transition_ids().unwrap().1;
    let error = buffer.set_priorities(&[ids[0], foreign], &[0.5, 0.5]).unwrap_err();
    assert_eq!(error, PriorityError::UnknownTransition { number: foreign.get() });
    assert!(ids.iter().all(|id| buffer.priority(*id) == Some(1.0)));

    let mut plain = HerBuffer::<f64>::new(BufferConfig::new(30, DIMS))?;
    add(&mut plain, 1, 3, (false, true));
    let none = plain.set_priorities(&[], &[0.5_f32; 0]);
    assert_eq!(none, Err(PriorityError::NoPriorities));
    let result = sampler().sample(&plain, &Telling, 0, &mut Batch::<f64>::new());
    assert_eq!(result, Err(SampleError::NoPriorities));
    Ok(())
}

#[test]
fn every_strategy_works_with_priorities_on_any_number_of_threads() -> Result {
    let gamma = UnitInterval::new(0.9)?;
    let part = |strategy| GoalPart::new(strategy, 1.0);
    let goals = GoalMixture::new(&[
        part(GoalStrategy::Future),
        part(GoalStrategy::Final),
        part(GoalStrategy::Episode),
        part(GoalStrategy::Random),
        part(GoalStrategy::Geometric { gamma }),
    ])?;
    let n_step = NStep::new(NonZeroUsize::MIN.saturating_add(2), gamma);
    for unit in [PriorityUnit::Transition, PriorityUnit::Episode] {
        let mut buffer = wrapped(unit);
        let ids = live(&buffer);
        let priorities: Vec<f64> = (0..30_u8).map(|at| f64::from(at % 3)).collect();
        buffer.set_priorities(&ids, &priorities)?;
        let sampler = sampler().with_goals(goals).with_ratio(UnitInterval::from_k(4));
        let sampler = sampler.with_batch_size(2001);
        draw(&buffer, &sampler, 4);
        for sampler in [sampler, sampler.with_n_step(n_step).with_success(true)] {
            let (mut alone, mut together) = (Batch::<f64>::new(), Batch::<f64>::new());
            sampler.sample(&buffer, &Telling, 5, &mut alone)?;
            let drawn = alone.transition().iter().map(|id| buffer.priority(*id));
            assert!(drawn.into_iter().all(|priority| priority > Some(0.0)));
            for threads in [1, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
                let sample =
                    || sampler.with_parallel(true).sample(&buffer, &Telling, 5, &mut together);
                pool.install(sample)?;
                assert_eq!(alone, together);
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Compares with a map from transitions to priorities, through wraps, growth and clearing.
    #[test]
    fn priorities_stay_with_their_transitions(
        capacity in prop_oneof![1_usize..20, 60_usize..70],
        ops in prop::collection::vec((1_u32..25, prop::collection::vec(0_u8..5, 0..6)), 1..25),
    ) {
        let mut buffer = buffer(capacity, PriorityUnit::Transition);
        let (mut model, mut highest) = (BTreeMap::new(), 1.0);
        for (at, (len, changes)) in ops.into_iter().enumerate() {
            add(&mut buffer, at as u32, len, (false, true));
            let ids = live(&buffer);
            model.retain(|id, _| *id >= ids[0]);
            for id in &ids {
                model.entry(*id).or_insert(highest);
            }
            for (place, change) in changes.into_iter().enumerate() {
                let id = ids[place * 7 % ids.len()];
                let priority = f64::from(change);
                buffer.set_priorities(&[id], &[priority]).unwrap();
                model.insert(id, priority);
                highest = f64::max(highest, priority);
            }
            if at == 15 {
                buffer.clear();
                model.clear();
                highest = 1.0;
            }
            for (id, priority) in &model {
                prop_assert_eq!(buffer.priority(*id), Some(*priority));
            }
            let mut batch = Batch::<f64>::new();
            let drawn = sampler().with_batch_size(64).sample(&buffer, &Telling, 0, &mut batch);
            if model.values().all(|priority| *priority == 0.0) {
                prop_assert!(drawn.is_err());
            } else {
                drawn.unwrap();
                prop_assert!(batch.transition().iter().all(|id| model[id] > 0.0));
            }
        }
    }
}
