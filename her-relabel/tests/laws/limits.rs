//! Sizes and numbers from outside that are too large.

use std::num::NonZeroUsize;

use crate::common::{DIMS, Result, Telling, add, begin, buffer, step};
use her_relabel::{
    AddError, Batch, BufferConfig, ColumnsMut, ConfigError, EpisodeData, GoalStrategy, HerBuffer,
    LoadError, NStep, Normalizer, NormalizerConfig, NormalizerError, Normalizers, Priorities,
    PriorityUnit, SampleError, Sampler, StepData, StepRows, UnitInterval,
};

fn steps(steps: usize) -> NStep {
    NStep::new(NonZeroUsize::new(steps).unwrap(), UnitInterval::ONE)
}

#[test]
fn as_many_environments_as_no_memory_holds_are_an_error() {
    for num_envs in [usize::MAX, usize::MAX / 64, 1 << 50] {
        let config = BufferConfig::new(10, DIMS).with_num_envs(num_envs);
        assert_eq!(HerBuffer::<f32>::new(config).unwrap_err(), ConfigError::TooLarge);
    }
}

#[test]
fn a_batch_that_no_memory_holds_is_an_error_and_the_buffer_goes_on() -> Result {
    let config =
        BufferConfig::new(10, DIMS).with_priorities(Priorities::new(PriorityUnit::Transition));
    let mut buffer = HerBuffer::<f64>::new(config)?;
    add(&mut buffer, 1, 3, (false, true));
    let sampler = Sampler::new(4, GoalStrategy::Future, UnitInterval::from_k(1));
    let mut batch = Batch::<f64>::new();
    for batch_size in [usize::MAX, usize::MAX / 6, usize::MAX / 64, 1 << 50] {
        let too_large = sampler.with_batch_size(batch_size);
        for sampler in [
            too_large,
            too_large.with_priorities(UnitInterval::ONE),
            too_large.with_keep_already_achieved(UnitInterval::ZERO),
            too_large.with_n_step(steps(usize::MAX)),
        ] {
            sampler.with_batch_size(4).sample(&buffer, &Telling, 1, &mut batch)?;
            let result = sampler.sample(&buffer, &Telling, 1, &mut batch);
            assert_eq!(result, Err(SampleError::TooLarge));
            assert!(batch.is_empty() && batch.reward().is_empty());
        }
    }
    Ok(())
}

#[test]
fn windows_longer_than_any_episode_are_whole_episodes() -> Result {
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 3, (false, true));
    add(&mut buffer, 2, 7, (true, false));
    let sampler = Sampler::new(50, GoalStrategy::Future, UnitInterval::from_k(1));
    let draw = |n_step| -> Result<Batch<f64>> {
        let mut batch = Batch::new();
        sampler.with_n_step(steps(n_step)).sample(&buffer, &Telling, 1, &mut batch)?;
        Ok(batch)
    };
    for n_step in [8, 1_000_000_000_000, usize::MAX] {
        assert_eq!(draw(n_step)?, draw(7)?);
    }
    Ok(())
}

#[test]
fn vectors_that_no_memory_holds_are_an_error() {
    for dim in [usize::MAX, 1 << 50] {
        let error = Normalizer::new(NormalizerConfig::new(dim)).unwrap_err();
        assert_eq!(error, NormalizerError::NoMemory { dim });
    }
}

#[test]
fn a_deviation_without_a_reciprocal_is_refused() -> Result {
    let config = NormalizerConfig::new(1);
    let refused = Normalizer::new(config.with_min_std(1e-310)).unwrap_err();
    assert!(matches!(refused, NormalizerError::BadSetting { name: "min_std", .. }));
    let mut smallest = Normalizer::new(config.with_min_std(f64::MIN_POSITIVE))?;
    smallest.update(&[3.0])?;
    let mut value = [3.0];
    smallest.normalize(&mut value)?;
    assert_eq!(value, [0.0]);
    Ok(())
}

/// The rewards that are refused, and the kind of refusal.
const REFUSED: [(f64, bool); 5] =
    [(1.1e20, true), (-1.1e20, true), (1e300, true), (f64::INFINITY, false), (f64::NAN, false)];

fn is_refusal(error: Option<AddError>, is_finite: bool) -> bool {
    match error {
        Some(AddError::RewardTooLarge { field, index, value }) => {
            is_finite && field.starts_with("reward") && index == 0 && value.is_finite()
        }
        Some(AddError::NotFinite { field, index, value }) => {
            !is_finite && field.starts_with("reward") && index == 0 && !value.is_finite()
        }
        _ => false,
    }
}

const STEP: StepData<'static, f64> = StepData {
    action: &[0.0],
    reward: 0.0,
    next_observation: &[0.0; 2],
    next_achieved_goal: &[0.0; 3],
    terminated: false,
    truncated: false,
    fields: &[],
};

#[test]
fn a_reward_whose_sums_may_be_infinite_is_refused_wherever_it_is_added() -> Result {
    let mut buffer = buffer(10);
    for (reward, is_finite) in REFUSED {
        begin(&mut buffer, 0, 1)?;
        let error = buffer.add_step(0, &StepData { reward, ..STEP }).err();
        assert!(is_refusal(error, is_finite), "{reward}");
        assert_eq!(buffer.unfinished_steps(0), Ok(Some(0)));
        let rows: StepRows<'_, f64> = StepRows {
            env_index: &[0],
            stepped: &[true],
            started: &[false],
            action: &[0.0],
            reward: &[reward],
            next_observation: &[0.0; 2],
            next_achieved_goal: &[0.0; 3],
            terminated: &[false],
            truncated: &[true],
            ..StepRows::default()
        };
        let recorded = buffer.record(&rows)?;
        assert_eq!((recorded.skipped_steps, recorded.discarded_episodes), (1, 1));
        let refusal = recorded.first_refusal.map(|refused| refused.error);
        assert!(is_refusal(refusal, is_finite), "{reward}");
        let episode = EpisodeData {
            observation: &[0.0; 4],
            achieved_goal: &[0.0; 6],
            desired_goal: &[0.0; 3],
            action: &[0.0],
            reward: &[reward],
            terminated: false,
            truncated: true,
            fields: &[],
        };
        assert!(is_refusal(buffer.add_episode(&episode).err(), is_finite), "{reward}");
    }
    assert!(buffer.is_empty());
    Ok(())
}

#[test]
fn a_file_with_such_a_reward_is_damaged() -> Result {
    const REWARD: f64 = 12345.678;
    for is_finished in [true, false] {
        let mut buffer = buffer(10);
        begin(&mut buffer, 0, 1)?;
        step(&mut buffer, 0, 1, 0, (false, false))?;
        buffer.add_step(0, &StepData { reward: REWARD, truncated: is_finished, ..STEP })?;
        let mut bytes = Vec::new();
        buffer.write_to(&mut bytes)?;
        let at = bytes.windows(8).position(|word| word == REWARD.to_le_bytes());
        let at = at.ok_or("the reward is somewhere")?;
        for (reward, is_damaged) in [(1e20, false), (-1e20, false), (1.1e20, true), (-1e300, true)]
        {
            let end = bytes.len() - 4;
            bytes[at..at + 8].copy_from_slice(&f64::to_le_bytes(reward));
            let checksum = crc32fast::hash(&bytes[..end]);
            bytes[end..].copy_from_slice(&checksum.to_le_bytes());
            let error = HerBuffer::<f64>::read_from(&bytes[..]).err();
            assert_eq!(matches!(error, Some(LoadError::Damaged)), is_damaged, "{error:?}");
        }
    }
    Ok(())
}

#[test]
fn sums_of_the_largest_rewards_are_finite_in_a_batch_of_f32() -> Result {
    let mut buffer = buffer(2000);
    begin(&mut buffer, 0, 1)?;
    for t in 0..2000 {
        buffer.add_step(0, &StepData { reward: 1e20, truncated: t == 1999, ..STEP })?;
    }
    let sampler =
        Sampler::new(500, GoalStrategy::Future, UnitInterval::ZERO).with_n_step(steps(2000));
    let mut batch = Batch::<f32>::new();
    let mut reward = [0.0; 500];
    let columns = ColumnsMut { reward: &mut reward, ..ColumnsMut::default() };
    sampler.sample_into(&buffer, &Telling, 1, &mut batch, Normalizers::default(), columns)?;
    assert!(reward.iter().all(|reward| (1e20..=2e23).contains(reward)));
    Ok(())
}
