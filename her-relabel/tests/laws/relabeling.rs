//! The laws of hindsight relabeling.

use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::common::{Result, Telling, add, buffer, draw, relabel_all, rows};
use goal_reward::{DistanceReward, GoalError, GoalPairs, GoalReward};
use her_relabel::{
    Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer, NStep, SampleError, Sampler,
    Scalar, UnitInterval,
};

#[test]
fn the_ratio_holds_for_batches_of_one() {
    const BATCHES: u64 = 20_000;
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 6, (false, true));
    for k in [0, 1, 4] {
        let ratio = UnitInterval::from_k(k);
        let sampler = Sampler::new(1, GoalStrategy::Future, ratio);
        let relabeled = (0..BATCHES)
            .filter(|seed| draw(&buffer, &sampler, *seed)[0].new_goal.is_some())
            .count() as f64;
        let expected = BATCHES as f64 * ratio.get();
        let deviation = (expected * (1.0 - ratio.get())).sqrt();
        assert!((relabeled - expected).abs() <= 5.0 * deviation, "k = {k}: {relabeled}");
    }
    assert!((UnitInterval::from_k(4).get() - 0.8).abs() < 1e-15);
    let all = draw(&buffer, &relabel_all(5000, GoalStrategy::Future), 6);
    assert!(all.iter().all(|row| row.new_goal.is_some()));
}

#[test]
fn ratios_outside_of_zero_to_one_are_refused() {
    for bad in [-0.1, 1.5, f64::NAN] {
        assert!(UnitInterval::new(bad).is_err());
    }
}

/// A reward that counts its calls and the rows of the last one.
#[derive(Default)]
struct Counting {
    calls: AtomicUsize,
    rows: AtomicUsize,
}

impl GoalReward for Counting {
    fn reward(&self, _: &[f64], _: &[f64]) -> f64 {
        unreachable!("the buffer asks for whole batches")
    }
    fn is_success(&self, _: &[f64], _: &[f64]) -> bool {
        unreachable!("the buffer does not ask for success")
    }
    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        self.rows.store(pairs.len(), Ordering::Relaxed);
        pairs.map_into(out, |achieved, desired| Telling.reward(achieved, desired))
    }
}

#[test]
fn the_reward_is_called_once_with_the_relabeled_rows_or_not_at_all() -> Result {
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 6, (false, true));
    let mut batch = Batch::<f64>::new();
    let counting = Counting::default();
    let sampler = Sampler::new(64, GoalStrategy::Future, UnitInterval::from_k(1));
    sampler.sample(&buffer, &counting, 7, &mut batch)?;
    assert_eq!(counting.calls.load(Ordering::Relaxed), 1);
    let relabeled = batch.relabeled().filter(|relabeled| *relabeled).count();
    assert_eq!(counting.rows.load(Ordering::Relaxed), relabeled);
    assert!((1..64).contains(&relabeled));
    rows(&batch);

    let none = sampler.with_ratio(UnitInterval::ZERO);
    none.sample(&buffer, &counting, 7, &mut batch)?;
    assert_eq!(counting.calls.load(Ordering::Relaxed), 1);
    Ok(())
}

/// A reward that fails.
enum Bad {
    Panics,
    Fails,
    IsNan,
}

impl GoalReward for Bad {
    fn reward(&self, _: &[f64], _: &[f64]) -> f64 {
        f64::NAN
    }
    fn is_success(&self, _: &[f64], _: &[f64]) -> bool {
        false
    }
    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        match self {
            Self::Panics => panic!("a user's function may panic"),
            Self::Fails => Err(GoalError::Empty),
            Self::IsNan => pairs.map_into(out, |achieved, desired| self.reward(achieved, desired)),
        }
    }
}

#[test]
fn a_bad_reward_function_harms_nothing() -> Result {
    let mut buffer = buffer(100);
    add(&mut buffer, 1, 6, (false, true));
    let sampler = relabel_all(8, GoalStrategy::Future);
    let expected = draw(&buffer, &sampler, 8);
    let mut batch = Batch::<f64>::new();
    let result = sampler.sample(&buffer, &Bad::Fails, 8, &mut batch);
    assert_eq!(result, Err(SampleError::Reward(GoalError::Empty)));
    assert!(batch.is_empty());
    let result = sampler.sample(&buffer, &Bad::IsNan, 8, &mut batch);
    assert!(matches!(result, Err(SampleError::RewardNotFinite { row: 0, .. })));
    assert!(batch.is_empty());
    let panicked =
        catch_unwind(AssertUnwindSafe(|| sampler.sample(&buffer, &Bad::Panics, 8, &mut batch)));
    assert!(panicked.is_err());
    // Not even a row with the new goal and the old reward is left.
    assert!(batch.is_empty() && batch.desired_goal().is_empty() && batch.reward().is_empty());
    sampler.sample(&buffer, &Telling, 8, &mut batch)?;
    assert_eq!(rows(&batch), expected);
    Ok(())
}

/// The reward of a state at `distance` from the goal, in `dim` dimensions, in a batch of `T`.
fn reward_at<T: Scalar>(distance: f64, dim: usize) -> f64 {
    let dims = Dims { observation: 1, goal: dim, action: 1 };
    let goal = |place: f64| {
        let mut goal = vec![0.25; dim];
        goal[dim - 1] = place;
        goal
    };
    let mut buffer = HerBuffer::<f64>::new(BufferConfig::new(10, dims)).unwrap();
    buffer
        .add_episode(&EpisodeData {
            observation: &[0.0; 3],
            achieved_goal: &[goal(5.0), goal(0.0), goal(distance)].concat(),
            desired_goal: &goal(0.0),
            action: &[0.0; 2],
            reward: &[7.0; 2],
            terminated: false,
            truncated: true,
            fields: &[],
        })
        .unwrap();
    let mut batch = Batch::<T>::new();
    let sampler = relabel_all(32, GoalStrategy::Final).with_success(true);
    sampler.sample(&buffer, &DistanceReward::sparse(), 0, &mut batch).unwrap();
    let mut goals = batch.next_achieved_goal().chunks_exact(dim);
    let first = goals.position(|goal| goal[dim - 1].to_f64() == 0.0).unwrap();
    assert_eq!(batch.success()[first], distance < 0.05);
    batch.reward()[first].to_f64()
}

#[test]
fn goals_are_not_rounded_before_the_threshold() {
    // Both are 0.05 in f32.
    let (at, above) = (0.05, 0.050_000_000_000_000_01);
    assert_eq!(at as f32, above as f32);
    // Goals of three elements, as those of the Fetch tasks, take a path of their own.
    for dim in [1, 2, 3, 4] {
        for reward_at in [reward_at::<f32>, reward_at::<f64>] {
            assert_eq!(reward_at(at, dim).to_bits(), (-0.0_f64).to_bits());
            assert_eq!(reward_at(above, dim), -1.0);
        }
    }
}

#[test]
fn f32_goals_are_widened_for_the_reward() -> Result {
    let dims = Dims { observation: 1, goal: 1, action: 1 };
    let mut buffer = HerBuffer::<f32>::new(BufferConfig::new(10, dims))?;
    buffer.add_episode(&EpisodeData {
        observation: &[0.1_f64, 0.2],
        achieved_goal: &[0.0, 0.3],
        desired_goal: &[0.7],
        action: &[0.1],
        reward: &[-0.4],
        terminated: false,
        truncated: true,
        fields: &[],
    })?;
    let mut batch = Batch::<f32>::new();
    let sampler = relabel_all(1, GoalStrategy::Future);
    sampler.sample(&buffer, &DistanceReward::dense(), 0, &mut batch)?;
    assert_eq!(batch.next_achieved_goal(), [0.3_f32]);
    assert_eq!(batch.desired_goal(), [0.3_f32]);
    assert_eq!(batch.reward(), [0.0_f32]);
    let plain = sampler.with_ratio(UnitInterval::ZERO);
    plain.sample(&buffer, &DistanceReward::dense(), 0, &mut batch)?;
    assert_eq!(batch.reward(), [-0.4_f32]);
    assert_eq!(batch.desired_goal(), [0.7_f32]);
    Ok(())
}

#[test]
fn a_return_of_one_reward_keeps_its_bits() -> Result {
    let mut buffer = buffer(10);
    buffer.add_episode(&EpisodeData {
        observation: &[0.0; 4],
        achieved_goal: &[0.0; 6],
        desired_goal: &[0.0; 3],
        action: &[0.0],
        reward: &[-0.0],
        terminated: false,
        truncated: true,
        fields: &[],
    })?;
    let sampler = Sampler::new(9, GoalStrategy::Future, UnitInterval::ZERO);
    let n_step = |steps| NStep::new(steps, UnitInterval::ONE);
    let [one, nine] = [NonZeroUsize::MIN, NonZeroUsize::MIN.saturating_add(8)].map(n_step);
    let mut batch = Batch::<f64>::new();
    for sampler in [sampler, sampler.with_n_step(one), sampler.with_n_step(nine)] {
        sampler.sample(&buffer, &Telling, 1, &mut batch)?;
        assert!(batch.reward().iter().all(|reward| reward.to_bits() == (-0.0_f64).to_bits()));
    }
    Ok(())
}
