//! Priorities: which ones transitions have, and which ones are refused.

use crate::common::{DIMS, Result, Telling, add};
use her_relabel::{
    Batch, BufferConfig, ConfigError, GoalStrategy, HerBuffer, NewPriority, Priorities,
    PriorityError, PriorityUnit, SampleError, Sampler, TransitionId, UnitInterval,
};

fn sampler() -> Sampler {
    Sampler::new(9, GoalStrategy::Future, UnitInterval::ZERO).with_priorities(UnitInterval::ONE)
}

fn buffer(capacity: usize, unit: PriorityUnit) -> HerBuffer<f64> {
    let config = BufferConfig::new(capacity, DIMS).with_priorities(Priorities::new(unit));
    HerBuffer::new(config).unwrap()
}

/// All live transitions, oldest first.
fn live(buffer: &HerBuffer<f64>) -> Vec<TransitionId> {
    let (oldest, newest) = buffer.transition_ids().unwrap();
    (oldest.get()..=newest.get()).map(|number| TransitionId::new(number).unwrap()).collect()
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
