//! Episodes of another buffer.

use crate::common::{DIMS, Result, add, begin, buffer, step};
use her_relabel::{AddError, BufferConfig, Dims, HerBuffer, MotionlessEpisodes, UnitInterval};
use proptest::prelude::*;

fn saved(buffer: &HerBuffer<f64>) -> Vec<u8> {
    let mut bytes = Vec::new();
    buffer.write_to(&mut bytes).expect("a vector takes all");
    bytes
}

proptest! {
    /// Also if either buffer must drop its oldest transitions.
    #[test]
    fn a_buffer_with_another_appended_equals_one_that_got_all_episodes(
        lens in prop::collection::vec(1u32..8, 0..12),
        at in any::<prop::sample::Index>(),
        capacities in (1usize..40, 1usize..40),
    ) {
        let split = at.index(lens.len() + 1);
        let (mut first, mut second) = (buffer(capacities.0), buffer(capacities.1));
        for (episode, len) in (0..).zip(&lens) {
            let target = if (episode as usize) < split { &mut first } else { &mut second };
            add(target, episode, *len, (episode % 2 == 0, true));
        }
        let mut whole = first.clone();
        first.append(&second)?;
        // Whatever the second buffer has dropped, the whole never gets.
        let total: usize = lens[split..].iter().map(|len| *len as usize).sum();
        let mut dropped = total.saturating_sub(capacities.1);
        if dropped == 0 {
            for (episode, len) in (0..).zip(&lens).skip(split) {
                add(&mut whole, episode, *len, (episode % 2 == 0, true));
            }
            prop_assert!(saved(&first) == saved(&whole));
        } else {
            let kept = lens[split..].iter().filter(|len| {
                let is_gone = dropped >= **len as usize;
                dropped = dropped.saturating_sub(**len as usize);
                !is_gone
            });
            prop_assert_eq!(second.num_episodes(), kept.count());
            prop_assert_eq!(first.len(), (whole.len() + second.len()).min(capacities.0));
        }
    }
}

#[test]
fn unfinished_episodes_stay_where_they_are() -> Result {
    let (mut first, mut second) = (buffer(20), buffer(20));
    begin(&mut first, 0, 1)?;
    step(&mut first, 0, 1, 0, (false, false))?;
    add(&mut second, 2, 3, (false, true));
    begin(&mut second, 0, 3)?;
    step(&mut second, 0, 3, 0, (false, false))?;
    first.append(&second)?;
    assert_eq!((first.len(), first.unfinished_steps(0)?), (3, Some(1)));
    assert_eq!((second.len(), second.unfinished_steps(0)?), (3, Some(1)));
    step(&mut first, 0, 1, 1, (true, false))?;
    assert_eq!((first.len(), first.num_episodes()), (5, 2));
    Ok(())
}

/// The other buffer has already decided, so a share of a share is never kept.
#[test]
fn motionless_episodes_that_the_other_buffer_keeps_are_added() -> Result {
    let none = MotionlessEpisodes::new(1e9, UnitInterval::ZERO);
    let mut strict = HerBuffer::new(BufferConfig::new(20, DIMS).with_motionless_episodes(none))?;
    add(&mut strict, 1, 3, (false, true));
    assert!(strict.is_empty());
    let mut other = buffer(20);
    add(&mut other, 1, 3, (false, true));
    strict.append(&other)?;
    assert_eq!(strict.num_episodes(), 1);
    Ok(())
}

#[test]
fn buffers_with_other_rows_are_refused_and_nothing_changes() -> Result {
    let fields = |names: &[(&str, usize)]| {
        let config = BufferConfig::new(20, DIMS);
        let config =
            names.iter().fold(config, |config, (name, len)| config.with_field(*name, *len));
        HerBuffer::<f64>::new(config)
    };
    let mut plain = buffer(20);
    add(&mut plain, 1, 3, (false, true));
    let before = saved(&plain);
    let longer = HerBuffer::new(BufferConfig::new(20, Dims { goal: 4, ..DIMS }))?;
    let error = plain.append(&longer).unwrap_err();
    assert_eq!(error, AddError::WrongLength { field: "goals".into(), expected: 3, actual: 4 });
    assert!(matches!(plain.append(&fields(&[("cost", 1)])?), Err(AddError::UnknownField(_))));
    let mut two = fields(&[("cost", 1), ("log_prob", 2)])?;
    let missing = |name: &str| Err(AddError::MissingField { name: name.into() });
    assert_eq!(two.append(&plain), missing("cost"));
    assert_eq!(two.append(&fields(&[("log_prob", 2), ("cost", 1)])?), missing("cost"));
    let error = two.append(&fields(&[("cost", 1), ("log_prob", 3)])?).unwrap_err();
    assert_eq!(error, AddError::WrongLength { field: "log_prob".into(), expected: 2, actual: 3 });
    assert!(saved(&plain) == before && two.is_empty());
    Ok(())
}

#[test]
fn episodes_of_another_task_are_refused() -> Result {
    let of = |task: &str| HerBuffer::<f64>::new(BufferConfig::new(20, DIMS).with_task(task));
    let (mut push, mut slide, mut unknown) = (of("push")?, of("slide")?, of("")?);
    for buffer in [&mut push, &mut slide, &mut unknown] {
        add(buffer, 1, 3, (false, true));
    }
    let before = saved(&push);
    let error = AddError::OtherTask { own: "push".into(), other: "slide".into() };
    assert_eq!(push.append(&slide), Err(error));
    assert_eq!(saved(&push), before);
    push.append(&push.clone())?;
    push.append(&unknown)?;
    unknown.append(&slide)?;
    assert_eq!((push.len(), unknown.len()), (9, 6));
    Ok(())
}
