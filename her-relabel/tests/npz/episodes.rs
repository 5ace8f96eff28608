//! Imported episodes are the exported ones.

use her_relabel::{
    EpisodeData, HerBuffer, MotionlessEpisodes, Priorities, PriorityUnit, TransitionId,
    UnitInterval,
};

use crate::common::{Result, add, config, drawn, exported, filled};

#[test]
fn imported_episodes_are_the_exported_ones() -> Result {
    // A whole buffer, and the rest of a ring that has wrapped.
    for capacity in [100, 33] {
        let buffer = filled::<f32>(capacity, 12);
        let bytes = exported(&buffer);
        let mut same = HerBuffer::<f32>::new(config(capacity))?;
        let count = same.import_npz_bytes(&bytes)?;
        assert_eq!(count, buffer.num_episodes() as u64);
        assert_eq!((same.len(), same.num_episodes()), (buffer.len(), buffer.num_episodes()));
        assert_eq!(drawn(&same), drawn(&buffer));
        // These numbers are exact in both types.
        let mut wider = HerBuffer::<f64>::new(config(capacity))?;
        wider.import_npz_bytes(&bytes)?;
        assert_eq!(drawn(&wider), drawn(&buffer));
        assert_eq!(exported(&filled::<f64>(capacity, 12)), exported(&wider));
    }
    Ok(())
}

#[test]
fn episodes_are_added_to_what_is_there_and_the_newest_are_kept() -> Result {
    let archive = exported(&filled::<f64>(1000, 9));
    for capacity in [4, 20, 45, 60] {
        let mut imported = HerBuffer::<f64>::new(config(capacity))?;
        let mut added = HerBuffer::<f64>::new(config(capacity))?;
        add(&mut imported, 10);
        add(&mut added, 10);
        imported.import_npz_bytes(&archive)?;
        (0..9).for_each(|episode| add(&mut added, episode));
        assert_eq!(drawn(&imported), drawn(&added));
    }
    Ok(())
}

#[test]
fn motionless_episodes_are_left_out_as_if_they_were_added_one_by_one() -> Result {
    // The first three move far. If the motionless ones after them were stored first, and left out
    // only then, they would push those out.
    let episodes = [5, 6, 7, 0, 1, 2, 3, 0, 1, 2, 3];
    let mut all = HerBuffer::<f64>::new(config(1000))?;
    episodes.iter().for_each(|episode| add(&mut all, *episode));
    for kept in [0.0, 0.5] {
        let motionless = MotionlessEpisodes::new(0.3, UnitInterval::new(kept)?).with_seed(3);
        let config = config(25).with_motionless_episodes(Some(motionless));
        let mut imported = HerBuffer::<f64>::new(config.clone())?;
        let mut added = HerBuffer::<f64>::new(config)?;
        for _ in 0..3 {
            assert_eq!(imported.import_npz_bytes(&exported(&all))?, 11);
            episodes.iter().for_each(|episode| add(&mut added, *episode));
            assert_eq!(imported.num_episodes(), added.num_episodes());
            assert_eq!(drawn(&imported), drawn(&added));
        }
    }
    Ok(())
}

#[test]
fn priorities_stay_and_imported_transitions_get_that_of_new_ones() -> Result {
    let priorities = Priorities::new(PriorityUnit::Transition);
    let mut buffer = HerBuffer::<f64>::new(config(100).with_priorities(priorities))?;
    add(&mut buffer, 1);
    let (oldest, newest) = buffer.transition_ids().ok_or("it is empty")?;
    buffer.set_priorities(&[oldest, newest], &[0.25, 5.0])?;
    buffer.import_npz_bytes(&exported(&filled::<f64>(100, 2)))?;
    let ids = (oldest.get()..).take(buffer.len()).filter_map(TransitionId::new);
    let found: Vec<Option<f64>> = ids.map(|id| buffer.priority(id)).collect();
    assert_eq!(found, [0.25, 5.0, 5.0, 5.0, 5.0].map(Some));
    Ok(())
}

#[test]
fn an_empty_buffer_is_an_archive_of_no_episodes() -> Result {
    let empty = exported(&filled::<f64>(50, 0));
    let mut buffer = filled::<f64>(50, 2);
    assert_eq!(buffer.import_npz_bytes(&empty)?, 0);
    assert_eq!(buffer.num_episodes(), 2);
    Ok(())
}

/// Written by numpy 2.4: `numpy.savez_compressed` of two episodes of two and one steps, with
/// integers of 64 bits and floats of 32 and 64 bits mixed, and an unrelated array.
#[test]
fn what_numpy_compressed_is_read() -> Result {
    let mut buffer = HerBuffer::<f32>::new(config(50))?;
    let archive = include_bytes!("numpy.npz");
    assert_eq!(buffer.import_npz_bytes(archive)?, 2);
    let mut expected = HerBuffer::<f32>::new(config(50))?;
    for (observations, actions, latent, terminated) in [
        (&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0][..], &[0.5, 1.5][..], &[0.0, 1.0, 2.0, 3.0][..], false),
        (&[6.0, 7.0, 8.0, 9.0], &[2.5], &[4.0, 5.0], true),
    ] {
        let data = EpisodeData {
            observation: observations,
            achieved_goal: &observations[..observations.len() / 2],
            desired_goal: &[if terminated { 20.0 } else { 10.0 }],
            action: actions,
            reward: &vec![-1.0; actions.len()],
            terminated,
            truncated: !terminated,
            fields: &[("log_prob", actions), ("latent", latent)],
        };
        expected.add_episode(&data)?;
    }
    assert_eq!(drawn(&buffer), drawn(&expected));
    Ok(())
}
