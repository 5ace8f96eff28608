//! The file format: two files byte by byte, and the bounds of the numbers in a file.

use std::num::NonZeroUsize;

use crate::common::{DIMS, Result, Telling, begin, buffer, step};
use crate::damaged::sealed;
use crate::saving::{load, saved};
use her_relabel::{
    Batch, BufferConfig, ConfigError, EpisodeData, GoalStrategy, HerBuffer, LoadError,
    MotionlessEpisodes, NStep, Priorities, PriorityUnit, Sampler, StartData, StepData,
    UnitInterval,
};

/// A buffer with all that a file can hold: fields, priorities, a ring that has wrapped, and an
/// unfinished episode.
fn everything(config: BufferConfig) -> Result<HerBuffer<f32>> {
    let config = config
        .with_num_envs(2)
        .with_field("value", 1)
        .with_field("latent", 2)
        .with_priorities(Priorities::new(PriorityUnit::Transition));
    let mut buffer = HerBuffer::new(config)?;
    for episode in 0..3_u8 {
        let number = f32::from(episode);
        buffer.add_episode(&EpisodeData {
            observation: &[number, -0.0, number, 0.1, number, 0.2, number, 0.3],
            achieved_goal: &[number, 0.0, 0.0, 0.1, number, 0.2, 0.3, 0.4, number, 0.5, 0.6, 0.7],
            desired_goal: &[0.5, 0.6, number],
            action: &[0.25, -0.25, 1e-40],
            reward: &[-1.0, -0.0, number],
            terminated: episode == 1,
            truncated: episode != 1,
            fields: &[("latent", &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]), ("value", &[6.0, 7.0, 8.0])],
        })?;
    }
    let (oldest, newest) = buffer.transition_ids().ok_or("it is empty")?;
    buffer.set_priorities(&[oldest, newest], &[0.125, 3.0])?;
    buffer.begin_episode(
        1,
        &StartData {
            observation: &[9.0, 0.0],
            achieved_goal: &[9.0, 0.5, 0.25],
            desired_goal: &[0.75; 3],
        },
    )?;
    buffer.add_step(
        1,
        &StepData {
            action: &[0.5],
            reward: -1.0,
            next_observation: &[9.0, 1.0],
            next_achieved_goal: &[9.0, 1.0, 0.25],
            terminated: false,
            truncated: false,
            fields: &[("value", &[1.0]), ("latent", &[2.0, 3.0])],
        },
    )?;
    Ok(buffer)
}

#[test]
fn files_are_read_and_written_byte_by_byte() -> Result {
    let config = BufferConfig::new(8, DIMS);
    let motionless = MotionlessEpisodes::new(0.125, UnitInterval::new(0.75)?).with_seed(5);
    for (config, file) in [
        (config.clone(), &include_bytes!("all_episodes.her")[..]),
        (config.with_motionless_episodes(motionless), include_bytes!("motionless_episodes.her")),
    ] {
        let buffer = everything(config)?;
        let mut written = Vec::new();
        buffer.write_to(&mut written)?;
        assert_eq!(
            written,
            file,
            "{motionless:?}",
            motionless = buffer.config().motionless_episodes()
        );
        let loaded = HerBuffer::<f32>::read_from(file)?;
        assert_eq!(loaded.config(), buffer.config());
        assert_eq!(loaded.transition_ids(), buffer.transition_ids());
        // The highest priority so far is that of new transitions.
        for mut buffer in [buffer, loaded] {
            buffer.end_episode(1)?;
            let newest = buffer.transition_ids().ok_or("it is empty")?.1;
            assert_eq!(buffer.priority(newest), Some(3.0));
        }
    }
    Ok(())
}

/// A buffer of one episode of three steps, whose file has no fields and no priorities.
fn plain(capacity: usize) -> HerBuffer<f64> {
    let mut buffer = buffer(capacity);
    crate::common::add(&mut buffer, 1, 3, (false, true));
    buffer
}

/// Replaces numbers of a file.
fn with_numbers(file: &[u8], numbers: &[(usize, u64)]) -> Vec<u8> {
    let mut changed = file.to_vec();
    for (at, number) in numbers {
        changed[*at..at + 8].copy_from_slice(&number.to_le_bytes());
    }
    sealed(changed)
}

const CAPACITY: usize = 16;
const LIVE_START: usize = 112;
const KEPT_START: usize = 128;
/// The record of the first episode: four times the number of its first transition, and its flags.
const RECORD: usize = 144;

fn is_damaged(file: &[u8]) -> bool {
    match load(file) {
        Ok(_) => false,
        Err(LoadError::Damaged) => true,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn transitions_are_numbered_up_to_a_bound() {
    let file = saved(&plain(8));
    let shifted = |start: u64, episode: u64| {
        let (live, kept) = ((LIVE_START, start), (KEPT_START, episode));
        let ends = [(LIVE_START + 8, start + 3), (KEPT_START + 8, episode + 1)];
        with_numbers(&file, &[live, kept, ends[0], ends[1], (RECORD, start << 2 | 1)])
    };
    let last = (1 << 60) - 3;
    assert!(!is_damaged(&shifted(0, 0)) && !is_damaged(&shifted(last, 0)));
    assert!(is_damaged(&shifted(last + 1, 0)));
    // A dropped episode had at least one transition.
    assert!(!is_damaged(&shifted(7, 7)) && is_damaged(&shifted(7, 8)));
    // An episode has a transition.
    let many = with_numbers(&file, &[(KEPT_START + 8, 4)]);
    assert!(is_damaged(&many));
    // The numbers of an episode's transitions rise.
    let falling = with_numbers(&file, &[(LIVE_START, 4)]);
    assert!(is_damaged(&falling));
}

#[test]
fn every_episode_has_a_transition() {
    let mut buffer = buffer(8);
    (0..3).for_each(|episode| crate::common::add(&mut buffer, episode, 2, (false, true)));
    let file = saved(&buffer);
    let second = |first: u64| with_numbers(&file, &[(RECORD + 8, first << 2 | 1)]);
    assert!(!is_damaged(&second(1)) && !is_damaged(&second(2)) && !is_damaged(&second(3)));
    // The second cannot begin with the same transition as the first or the third.
    assert!(is_damaged(&second(0)) && is_damaged(&second(4)));
    // The first begins with the first transition that is left, or before it.
    assert!(is_damaged(&with_numbers(&file, &[(RECORD, 1 << 2 | 1)])));
}

#[test]
fn a_loaded_buffer_knows_its_longest_episode() -> Result {
    let file = saved(&plain(8));
    let last = (1 << 60) - 3;
    let numbers = [(LIVE_START, last), (LIVE_START + 8, last + 3), (RECORD, last << 2 | 1)];
    let loaded = load(&with_numbers(&file, &numbers))?;
    // The memory is that of a window of three steps.
    let steps = NStep::new(NonZeroUsize::MAX, UnitInterval::ONE);
    let sampler = Sampler::new(20, GoalStrategy::Future, UnitInterval::ONE).with_n_step(steps);
    sampler.sample(&loaded, &Telling, 1, &mut Batch::<f64>::new())?;
    Ok(())
}

/// More elements than are read at a time.
#[test]
fn long_parts_are_read_whole() -> Result {
    let mut buffer = buffer(2000);
    begin(&mut buffer, 0, 1)?;
    for t in 0..1500 {
        step(&mut buffer, 0, 1, t, (false, false))?;
    }
    assert_eq!(saved(&load(&saved(&buffer))?), saved(&buffer));
    buffer.end_episode(0)?;
    assert_eq!(saved(&load(&saved(&buffer))?), saved(&buffer));
    Ok(())
}

#[test]
fn a_file_holds_no_more_transitions_than_the_capacity() {
    let file = saved(&plain(8));
    assert!(!is_damaged(&with_numbers(&file, &[(CAPACITY, 3)])));
    assert!(is_damaged(&with_numbers(&file, &[(CAPACITY, 2)])));
    // As many episodes as transitions.
    let mut buffer = buffer(8);
    (0..8).for_each(|episode| crate::common::add(&mut buffer, episode, 1, (false, true)));
    assert!(!is_damaged(&saved(&buffer)));
}

#[test]
fn an_unfinished_episode_is_saved_at_any_length_and_no_file_holds_a_longer_one() -> Result {
    const MOST: usize = 5;
    let mut growing = buffer(MOST);
    begin(&mut growing, 0, 1)?;
    let mut longest = 0;
    for t in 0..6 * MOST as u32 {
        step(&mut growing, 0, 1, t, (false, false))?;
        let file = saved(&growing);
        longest = longest.max(file.len());
        let mut loaded = load(&file)?;
        assert_eq!(loaded.unfinished_steps(0), Ok(Some(MOST.min(t as usize + 1))));
        let mut ended = growing.clone();
        ended.end_episode(0)?;
        loaded.end_episode(0)?;
        assert_eq!(saved(&loaded), saved(&ended));
    }
    // The file of a larger buffer that claims to be of this one.
    let mut larger = buffer(10 * MOST);
    begin(&mut larger, 0, 1)?;
    for t in 0..2 * MOST as u32 {
        let file = with_numbers(&saved(&larger), &[(CAPACITY, MOST as u64)]);
        assert!(!is_damaged(&file) && file.len() <= longest, "{t} steps");
        step(&mut larger, 0, 1, t, (false, false))?;
    }
    assert!(is_damaged(&with_numbers(&saved(&larger), &[(CAPACITY, MOST as u64)])));
    Ok(())
}

#[test]
fn the_tree_of_priorities_has_a_size_that_fits() -> Result {
    let config =
        BufferConfig::new(12, DIMS).with_priorities(Priorities::new(PriorityUnit::Transition));
    let mut buffer = HerBuffer::<f64>::new(config)?;
    // The first of the episodes is dropped.
    (0..2).for_each(|episode| crate::common::add(&mut buffer, episode, 12, (false, true)));
    let file = saved(&buffer);
    // Before the checksum come the priorities, before them the size, and before that the highest.
    let size = file.len() - 4 - 12 * 8 - 8;
    for (number, fits) in [(16, true), (8, false), (15, false), (32, false), (0, false)] {
        assert_eq!(is_damaged(&with_numbers(&file, &[(size, number)])), !fits, "{number} places");
    }
    for (highest, fits) in [(0.0, true), (1e200, true), (1.1e200, false), (-0.5, false)] {
        let changed = with_numbers(&file, &[(size - 8, f64::to_bits(highest))]);
        assert_eq!(is_damaged(&changed), !fits, "{highest}");
        let changed = with_numbers(&file, &[(size + 8 * 12, f64::to_bits(highest))]);
        assert_eq!(is_damaged(&changed), !fits, "{highest}");
    }
    Ok(())
}

#[test]
fn names_of_fields_have_a_greatest_length() -> Result {
    let name = "n".repeat(64);
    let buffer = HerBuffer::<f64>::new(BufferConfig::new(8, DIMS).with_field(&name, 1))?;
    let file = saved(&buffer);
    assert_eq!(load(&file)?.config(), buffer.config());
    let field = 16 + 6 * 8;
    let mut longer = with_numbers(&file, &[(field, 65)]);
    longer.insert(field + 8, b'n');
    assert!(is_damaged(&sealed(longer)));
    Ok(())
}

#[test]
fn a_file_keeps_the_description_of_the_task() -> Result {
    for task in ["FetchPush, sparse", "\u{e4}\u{1F916}", &"t".repeat(8192)] {
        let described = HerBuffer::<f64>::new(BufferConfig::new(8, DIMS).with_task(task))?;
        let file = saved(&described);
        let loaded = load(&file)?;
        assert_eq!((loaded.config(), loaded.config().task()), (described.config(), task));
        assert_eq!(saved(&loaded), file);
        // Apart from the version and the description, it is the file of a buffer without one.
        let plain = saved(&HerBuffer::<f64>::new(BufferConfig::new(8, DIMS))?);
        let (at, len) = (16 + 6 * 8, task.len());
        assert_eq!((file[8], plain[8]), (3, 2));
        assert_eq!(file[at..at + 8], (len as u64).to_le_bytes());
        assert_eq!(&file[at + 8..at + 8 + len], task.as_bytes());
        assert_eq!(file[at + 8 + len..file.len() - 4], plain[at..plain.len() - 4]);
        // No description, one that is too long, and one that is not UTF-8.
        let mut none = with_numbers(&file, &[(at, 0)]);
        none.drain(at + 8..at + 8 + len);
        assert!(is_damaged(&sealed(none)));
        let mut longer = with_numbers(&file, &[(at, 8193)]);
        longer.splice(at + 8..at + 8, vec![b't'; 8193 - len]);
        assert!(is_damaged(&sealed(longer)));
        let mut wrong = file;
        wrong[at + 8] = 0xff;
        assert!(is_damaged(&sealed(wrong)));
    }
    let error = HerBuffer::<f64>::new(BufferConfig::new(8, DIMS).with_task("t".repeat(8193)));
    assert_eq!(error.err(), Some(ConfigError::TaskTooLong { len: 8193 }));
    Ok(())
}
