//! The ring keeps the newest steps, and never gives a number twice.

use std::collections::BTreeSet;

use crate::common::{Result, Telling, add, begin, buffer, draw, relabel_all, step};
use her_relabel::{Batch, GoalStrategy, SampleError};

#[test]
fn an_episode_longer_than_the_buffer_keeps_its_end() -> Result {
    for capacity in [1, 3, 10] {
        for len in [capacity as u32, 11, 20, 21, 100] {
            let (mut whole, mut stepped) = (buffer(capacity), buffer(capacity));
            add(&mut whole, 1, len, (true, false));
            begin(&mut stepped, 0, 1)?;
            for t in 0..len {
                step(&mut stepped, 0, 1, t, (t + 1 == len, false))?;
                assert!(stepped.unfinished_steps(0)?.unwrap_or(0) <= capacity);
            }
            let kept = len - capacity as u32..len;
            for buffer in [whole, stepped] {
                assert_eq!((buffer.len(), buffer.num_episodes()), (capacity, 1));
                let rows = draw(&buffer, &relabel_all(30 * capacity, GoalStrategy::Episode), 0);
                let steps: BTreeSet<_> = rows.iter().map(|row| (row.t, row.ends)).collect();
                assert!(steps.into_iter().eq(kept.clone().map(|t| (t, (t + 1 == len, false)))));
                let goals: BTreeSet<_> = rows.iter().filter_map(|row| row.new_goal).collect();
                assert!(goals.into_iter().eq(kept.clone().map(|t| (1, t + 1))));
            }
        }
    }
    Ok(())
}

#[test]
fn a_cleared_buffer_is_empty_and_never_reuses_a_number() -> Result {
    let mut buffer = buffer(50);
    begin(&mut buffer, 0, 1)?;
    add(&mut buffer, 2, 5, (false, true));
    let (_, newest) = buffer.transition_ids().unwrap();
    buffer.clear();
    assert_eq!((buffer.len(), buffer.num_episodes()), (0, 0));
    assert_eq!(buffer.unfinished_steps(0), Ok(None));
    let sampler = relabel_all(4, GoalStrategy::Future);
    let result = sampler.sample(&buffer, &Telling, 0, &mut Batch::<f64>::new());
    assert_eq!(result, Err(SampleError::NoFinishedEpisode));
    add(&mut buffer, 3, 5, (false, true));
    assert!(buffer.transition_ids().unwrap().0 > newest);
    Ok(())
}
