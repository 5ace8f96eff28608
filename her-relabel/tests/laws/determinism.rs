//! Batches are functions of their seed, and readers see whole rows.

use std::sync::RwLock;
use std::thread;

use crate::common::{Result, Telling, add, begin, buffer, rows, step};
use her_relabel::{Batch, GoalStrategy, HerBuffer, SampleError, Sampler, UnitInterval};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

const SAMPLER: Sampler = Sampler::new(200, GoalStrategy::Future, UnitInterval::ONE);

#[test]
fn the_same_generator_gives_the_same_batches_and_another_gives_others() -> Result {
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 50, (false, true));
    let draw = |seed| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut batches = [Batch::<f64>::new(), Batch::<f64>::new()];
        for batch in &mut batches {
            SAMPLER.sample(&buffer, &Telling, &mut rng, batch).unwrap();
        }
        batches
    };
    let [first, second] = draw(1);
    assert_eq!([first.clone(), second.clone()], draw(1));
    assert_ne!(first, second);
    assert_ne!(first, draw(2)[0]);
    Ok(())
}

#[test]
fn a_batch_is_a_function_of_one_word_of_the_generator() -> Result {
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 50, (false, true));
    let (mut drawn, mut seeded) = (Batch::<f64>::new(), Batch::<f64>::new());
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    SAMPLER.sample(&buffer, &Telling, &mut rng, &mut drawn)?;
    let mut same = ChaCha8Rng::seed_from_u64(3);
    SAMPLER.sample(&buffer, &Telling, same.next_u64(), &mut seeded)?;
    assert_eq!(drawn, seeded);
    assert_eq!(rng.next_u64(), same.next_u64());
    Ok(())
}

#[test]
fn a_used_batch_gives_what_a_new_one_gives() -> Result {
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 50, (false, true));
    let (mut used, mut new) = (Batch::<f64>::new(), Batch::<f64>::new());
    let larger = SAMPLER.with_batch_size(500);
    larger.sample(&buffer, &Telling, 1, &mut used)?;
    SAMPLER.sample(&buffer, &Telling, 2, &mut used)?;
    SAMPLER.sample(&buffer, &Telling, 2, &mut new)?;
    assert_eq!(used, new);
    Ok(())
}

#[test]
fn sampling_changes_no_storage_and_a_batch_is_no_view_of_it() -> Result {
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 50, (false, true));
    begin(&mut buffer, 0, 2)?;
    let saved = |buffer: &HerBuffer<f64>| {
        let mut bytes = Vec::new();
        buffer.write_to(&mut bytes).unwrap();
        bytes
    };
    let before = saved(&buffer);
    let mut batch = Batch::<f64>::new();
    for seed in 0..10 {
        SAMPLER.with_parallel(true).sample(&buffer, &Telling, seed, &mut batch)?;
    }
    assert!(saved(&buffer) == before);
    let copy = batch.clone();
    for episode in 3..9 {
        add(&mut buffer, episode, 50, (false, true));
    }
    buffer.clear();
    assert_eq!(batch, copy);
    rows(&batch);
    Ok(())
}

#[test]
fn batches_beyond_memory_are_refused() -> Result {
    let mut buffer = buffer(10);
    add(&mut buffer, 1, 5, (false, true));
    let sampler = SAMPLER.with_batch_size(usize::MAX);
    let result = sampler.sample(&buffer, &Telling, 0, &mut Batch::<f64>::new());
    assert_eq!(result, Err(SampleError::TooLarge));
    Ok(())
}

#[test]
fn seeded_batches_are_pinned() -> Result {
    // A change of these numbers changes every user's results and belongs in the changelog.
    let mut buffer = buffer(1000);
    for episode in 0..20 {
        add(&mut buffer, episode, 50, (false, true));
    }
    let sampler = Sampler::new(6, GoalStrategy::Future, UnitInterval::from_k(4));
    let mut batch = Batch::<f64>::new();
    sampler.sample(&buffer, &Telling, 42, &mut batch)?;
    let drawn: Vec<_> = rows(&batch).iter().map(|row| (row.id, row.ahead)).collect();
    // Computed by another program from the definition of SplitMix64.
    let expected = [
        (742, Some(2)),
        (39, None),
        (340, Some(2)),
        (514, Some(24)),
        (104, Some(4)),
        (958, Some(25)),
    ];
    assert_eq!(drawn, expected);
    Ok(())
}

#[test]
fn used_batches_are_not_empty() -> Result {
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 50, (false, true));
    let mut batch = Batch::<f64>::new();
    assert_eq!((batch.len(), batch.is_empty()), (0, true));
    SAMPLER.sample(&buffer, &Telling, 1, &mut batch)?;
    assert_eq!((batch.len(), batch.is_empty()), (200, false));
    Ok(())
}

#[test]
fn nothing_can_be_drawn_before_an_episode_ends() -> Result {
    let mut buffer = buffer(100);
    let mut batch = Batch::<f64>::new();
    let result = SAMPLER.sample(&buffer, &Telling, 0, &mut batch);
    assert_eq!(result, Err(SampleError::NoFinishedEpisode));
    begin(&mut buffer, 0, 1)?;
    step(&mut buffer, 0, 1, 0, (false, false))?;
    let error = SAMPLER.sample(&buffer, &Telling, 0, &mut batch).unwrap_err();
    assert!(error.to_string().contains("call end_episode"));
    let none = SAMPLER.with_batch_size(0);
    add(&mut buffer, 2, 3, (false, true));
    assert_eq!(none.sample(&buffer, &Telling, 0, &mut batch), Err(SampleError::EmptyBatch));
    Ok(())
}

#[test]
fn readers_beside_a_writer_never_see_a_torn_row() -> Result {
    let mut first = buffer(300);
    add(&mut first, 0, 20, (false, true));
    let shared = RwLock::new(first);
    thread::scope(|scope| {
        for reader in 0..2 {
            let shared = &shared;
            scope.spawn(move || {
                let mut batch = Batch::<f64>::new();
                for seed in 0..300 {
                    let buffer = shared.read().unwrap();
                    SAMPLER.sample(&buffer, &Telling, reader * 1000 + seed, &mut batch).unwrap();
                    drop(buffer);
                    // Checks that every number of a row belongs to one transition.
                    rows(&batch);
                }
            });
        }
        for episode in 1..400 {
            add(&mut shared.write().unwrap(), episode, 1 + episode % 30, (false, true));
        }
    });
    Ok(())
}
