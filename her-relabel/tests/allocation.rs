//! Sampling, adding and loading under a counting allocator.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use std::num::NonZeroUsize;

use allocation_counter::measure;
use goal_reward::{DistanceReward, Mirror, Mirrored, Symmetry};
use her_relabel::{
    Batch, BufferConfig, ColumnsMut, Dims, EpisodeData, GoalMixture, GoalNoise, GoalStrategy,
    HerBuffer, JoinedGoal, NStep, Normalizer, NormalizerConfig, Normalizers, Priorities,
    PriorityUnit, Sampler, Scalar, StepRows, Termination, Transforms, UnitInterval,
};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const NUM_ENVS: usize = 4;
const STEPS: usize = 50;

fn config() -> BufferConfig {
    BufferConfig::new(1000, Dims { observation: 25, goal: 3, action: 4 })
        .with_num_envs(NUM_ENVS)
        .with_field("log_prob", 1)
        .with_field("latent", 8)
        .with_priorities(Priorities::new(PriorityUnit::Transition))
}

/// Adds a step of every environment, which ends the episodes and starts others if `is_last`.
fn add(buffer: &mut HerBuffer<f32>, is_last: bool) {
    let starts = StepRows {
        env_index: &[2, 0, 3, 1],
        stepped: &[false; NUM_ENVS],
        started: &[true; NUM_ENVS],
        truncated: &[false; NUM_ENVS],
        observation: &[0.5; NUM_ENVS * 25],
        achieved_goal: &[0.5; NUM_ENVS * 3],
        desired_goal: &[0.25; NUM_ENVS * 3],
        ..StepRows::default()
    };
    if buffer.unfinished_steps(0).unwrap().is_none() {
        buffer.record(&starts).unwrap().check().unwrap();
    }
    let steps = StepRows {
        stepped: &[true; NUM_ENVS],
        started: &[is_last; NUM_ENVS],
        action: &[0.0_f32; NUM_ENVS * 4],
        reward: &[-1.0; NUM_ENVS],
        next_observation: &[0.5; NUM_ENVS * 25],
        next_achieved_goal: &[0.5; NUM_ENVS * 3],
        terminated: &[false; NUM_ENVS],
        truncated: &[is_last; NUM_ENVS],
        fields: &[("log_prob", &[0.0; NUM_ENVS]), ("latent", &[0.0; NUM_ENVS * 8])],
        ..starts
    };
    assert_eq!(buffer.record(&steps).unwrap().recorded_steps, NUM_ENVS);
}

fn full() -> HerBuffer<f32> {
    let mut buffer = HerBuffer::new(config()).unwrap();
    (0..20 * STEPS).for_each(|step| add(&mut buffer, step % STEPS == STEPS - 1));
    assert_eq!(buffer.len(), 1000);
    buffer
}

#[test]
fn sampling_allocates_nothing_once_the_batch_has_its_size() -> Result {
    let buffer = full();
    let n_step = NStep::new(NonZeroUsize::MIN.saturating_add(2), UnitInterval::new(0.98)?);
    let plain = Sampler::new(256, GoalStrategy::Future, UnitInterval::from_k(4));
    let half = UnitInterval::new(0.5)?;
    let negated = |len| Mirror::new((0..len).map(Mirrored::negated).collect::<Vec<_>>());
    let symmetry = Symmetry { observation: negated(25)?, goal: negated(3)?, action: negated(4)? };
    for sampler in [
        plain,
        plain
            .with_goals(GoalMixture::only(GoalStrategy::Random))
            .with_termination(Termination::Recomputed),
        plain.with_n_step(n_step).with_success(true),
        plain.with_priorities(UnitInterval::ONE),
        plain.with_joined_goal(JoinedGoal::Desired).with_discount(UnitInterval::ONE),
        plain.with_joined_goal(JoinedGoal::Relative),
        plain.with_keep_already_achieved(UnitInterval::new(0.2)?),
        plain.with_mirrored(half).with_success(true),
        plain.with_goal_noise(GoalNoise::new(0.04, half)),
        plain
            .with_mirrored(half)
            .with_goal_noise(GoalNoise::new(0.04, half))
            .with_keep_already_achieved(half)
            .with_joined_goal(JoinedGoal::Relative),
    ] {
        let transforms = Transforms { symmetry: Some(&symmetry), ..Transforms::default() };
        assert_no_allocation(&buffer, &sampler, transforms, &mut Batch::<f32>::new());
        // Another element type, and normalizers.
        let mut batch = Batch::<f64>::new();
        assert_no_allocation(&buffer, &sampler, transforms, &mut batch);
        let normalizers = [25, 3].map(|dim| Normalizer::new(NormalizerConfig::new(dim)));
        let [observation, goal] = normalizers;
        let (observation, goal) = (observation?, goal?);
        let normalizers = Normalizers { observation: Some(&observation), goal: Some(&goal) };
        let transforms = Transforms { normalizers, ..transforms };
        assert_no_allocation(&buffer, &sampler, transforms, &mut batch);
    }
    Ok(())
}

fn assert_no_allocation<T: Scalar>(
    buffer: &HerBuffer<f32>,
    sampler: &Sampler,
    transforms: Transforms<'_>,
    batch: &mut Batch<T>,
) {
    let reward = DistanceReward::sparse();
    // With every row relabeled, the reward judges the most pairs of goals.
    let all = sampler.with_ratio(UnitInterval::ONE);
    let draw = |sampler: &Sampler, seed: u64, batch: &mut Batch<T>| {
        let columns = ColumnsMut::default();
        sampler.sample_into(buffer, &reward, seed, batch, transforms, columns).unwrap();
    };
    (0..20).for_each(|seed| draw(&all, seed, batch));
    let counted = measure(|| {
        for seed in 0..50 {
            draw(sampler, seed, batch);
            batch.field("latent").unwrap();
        }
    });
    assert_eq!(counted.count_total, 0, "{sampler:?}: {counted:?}");
}

#[test]
fn columns_that_come_back_and_memory_of_the_caller_s_allocate_nothing() -> Result {
    let buffer = full();
    let reward = DistanceReward::sparse();
    let sampler = Sampler::new(256, GoalStrategy::Future, UnitInterval::from_k(4))
        .with_joined_goal(JoinedGoal::Desired);
    let mut batch = Batch::<f32>::new();
    let mut input = vec![0.0; 256 * 28];
    let mut draw = |seed: u64| {
        let columns = ColumnsMut { input: &mut input, ..ColumnsMut::default() };
        sampler
            .sample_into(&buffer, &reward, seed, &mut batch, Normalizers::default(), columns)
            .unwrap();
        let columns = batch.take_columns();
        batch.give_back(columns);
    };
    (0..20).for_each(&mut draw);
    let counted = measure(|| (0..50).for_each(&mut draw));
    assert_eq!(counted.count_total, 0, "{counted:?}");
    Ok(())
}

#[test]
fn adding_to_a_full_ring_allocates_nothing() -> Result {
    let mut buffer = full();
    let ids = buffer.transition_ids().unwrap();
    let counted = measure(|| {
        for step in 0..10 * STEPS {
            add(&mut buffer, step % STEPS == STEPS - 1);
        }
        buffer.set_priorities(&[ids.0, ids.1], &[0.5, 1.5]).unwrap();
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    Ok(())
}

#[test]
fn windows_take_the_memory_of_the_longest_episode_only() -> Result {
    let buffer = full();
    let sampler = Sampler::new(256, GoalStrategy::Future, UnitInterval::from_k(4));
    let bytes = |steps: usize| -> Result<u64> {
        let steps = NonZeroUsize::new(steps).ok_or("no steps")?;
        let sampler = sampler.with_n_step(NStep::new(steps, UnitInterval::ONE));
        let mut batch = Batch::<f32>::new();
        let counted = measure(|| {
            sampler.sample(&buffer, &DistanceReward::sparse(), 1, &mut batch).unwrap();
        });
        Ok(counted.bytes_max)
    };
    assert_eq!(bytes(1_000_000)?, bytes(STEPS)?);
    // A loaded buffer knows its longest episode, too.
    let mut saved = Vec::new();
    buffer.write_to(&mut saved)?;
    let loaded = HerBuffer::<f32>::read_from(&saved[..])?;
    let n_step = NStep::new(NonZeroUsize::MAX, UnitInterval::ONE);
    let (mut one, mut other) = (Batch::<f32>::new(), Batch::<f32>::new());
    let sampler = sampler.with_n_step(n_step);
    sampler.sample(&buffer, &DistanceReward::sparse(), 1, &mut one)?;
    sampler.sample(&loaded, &DistanceReward::sparse(), 1, &mut other)?;
    assert_eq!(one, other);
    Ok(())
}

#[test]
fn no_file_asks_for_much_more_memory_than_it_has() -> Result {
    let dims = Dims { observation: 1, goal: 1, action: 1 };
    let mut buffer = HerBuffer::<f64>::new(BufferConfig::new(8, dims))?;
    let episode = EpisodeData {
        observation: &[0.0; 3],
        achieved_goal: &[0.0; 3],
        desired_goal: &[0.0],
        action: &[0.0; 2],
        reward: &[0.0; 2],
        terminated: false,
        truncated: true,
        fields: &[],
    };
    buffer.add_episode(&episode)?;
    let mut bytes = Vec::new();
    buffer.write_to(&mut bytes)?;
    // Six sizes, the number of fields among them, the priorities, and the counts.
    for number in 0..12 {
        for shift in 0..64 {
            let mut hostile = bytes.clone();
            hostile[16 + 8 * number..][..8].copy_from_slice(&(1_u64 << shift).to_le_bytes());
            let counted = measure(|| drop(HerBuffer::<f64>::read_from(&hostile[..])));
            // The smallest possible amount is one untouched block of the tape.
            let most = (1 << 23) + (1 << 17);
            assert!(counted.bytes_max < most, "number {number}, 2^{shift}: {counted:?}");
        }
    }
    Ok(())
}

#[test]
fn the_counting_allocator_counts() {
    assert_eq!(measure(|| drop(std::hint::black_box(vec![0_u8; 10]))).count_total, 1);
}
