//! The forms of a batch: another element type, joined goals, normalizers, discounts,
//! caller-provided memory. Each has the numbers of the plain batch.

use std::num::NonZeroUsize;

use crate::common::Result;
use goal_reward::{DistanceReward, GoalReward};
use her_relabel::{
    Batch, BufferConfig, ColumnsMut, Dims, EpisodeData, GoalMixture, GoalPart, GoalStrategy,
    HerBuffer, JoinedGoal, NStep, Normalizer, NormalizerConfig, NormalizerError, Normalizers,
    Priorities, PriorityUnit, SampleError, Sampler, Scalar, Termination, UnitInterval,
};

pub(crate) const DIMS: Dims = Dims { observation: 5, goal: 3, action: 2 };
pub(crate) const ROWS: usize = 700;

/// A reward that also ends the task.
pub(crate) struct Ending(DistanceReward);

impl GoalReward for Ending {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        self.0.reward(achieved_goal, desired_goal) + achieved_goal[0]
    }
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.0.is_success(achieved_goal, desired_goal)
    }
    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.is_success(achieved_goal, desired_goal)
    }
}

pub(crate) fn reward() -> Ending {
    Ending(DistanceReward::sparse())
}

/// A buffer of numbers that `f32` cannot hold, in episodes of 1 to 23 steps.
pub(crate) fn buffer() -> Result<HerBuffer<f64>> {
    let config = BufferConfig::new(400, DIMS)
        .with_field("value", 1)
        .with_field("latent", 2)
        .with_priorities(Priorities::new(PriorityUnit::Transition));
    let mut buffer = HerBuffer::new(config)?;
    let mut state = 1_u64;
    let mut random = |count: usize, scale: f64| -> Vec<f64> {
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * scale
        };
        (0..count).map(|_| next()).collect()
    };
    for steps in (1..24).chain(1..24) {
        buffer.add_episode(&EpisodeData {
            observation: &random((steps + 1) * DIMS.observation, 20.0),
            achieved_goal: &random((steps + 1) * DIMS.goal, 0.1),
            desired_goal: &random(DIMS.goal, 0.1),
            action: &random(steps * DIMS.action, 2.0),
            reward: &random(steps, 1.0),
            terminated: steps % 2 == 0,
            truncated: steps % 2 == 1,
            fields: &[("value", &random(steps, 1.0)), ("latent", &random(2 * steps, 1.0))],
        })?;
    }
    Ok(buffer)
}

pub(crate) fn normalizers() -> Result<[Normalizer; 2]> {
    let mut observation = Normalizer::new(NormalizerConfig::new(DIMS.observation).with_clip(1.2))?;
    observation.update(&[0.1, 0.2, 0.3, 0.4, 0.5, 3.0, 7.0, -1.0, 0.41, 9.0])?;
    let mut goal = Normalizer::new(NormalizerConfig::new(DIMS.goal))?;
    goal.update(&[0.01, 0.02, 0.03, -0.01, 0.05, 0.06])?;
    Ok([observation, goal])
}

pub(crate) fn samplers() -> Result<Vec<Sampler>> {
    let mixture = GoalMixture::new(&[
        GoalPart::new(GoalStrategy::Future, 2.0),
        GoalPart::new(GoalStrategy::PastDesired, 1.0),
    ])?;
    let plain = Sampler::new(ROWS, GoalStrategy::Future, UnitInterval::from_k(4));
    let n_step = NStep::new(NonZeroUsize::MIN.saturating_add(3), UnitInterval::new(0.9)?);
    let windows =
        plain.with_n_step(n_step).with_termination(Termination::Recomputed).with_success(true);
    Ok(vec![
        plain,
        plain.with_goals(mixture).with_success(true),
        windows,
        windows.with_parallel(true).with_goals(mixture),
        plain
            .with_keep_already_achieved(UnitInterval::new(0.2)?)
            .with_priorities(UnitInterval::ONE),
        windows.with_keep_already_achieved(UnitInterval::ZERO).with_parallel(true),
    ])
}

/// Converts a column, normalized if there is a normalizer.
fn formed<T: Scalar>(column: &[f64], normalizer: Option<&Normalizer>) -> Result<Vec<T>> {
    let mut formed: Vec<T> = column.iter().map(|value| T::from_f64(*value)).collect();
    if let Some(normalizer) = normalizer {
        normalizer.normalize_into(column, &mut formed)?;
    }
    Ok(formed)
}

fn joined<T: Scalar>(observations: &[T], goals: &[T]) -> Vec<T> {
    let rows = observations.chunks_exact(DIMS.observation).zip(goals.chunks_exact(DIMS.goal));
    rows.flat_map(|(observation, goal)| [observation, goal].concat()).collect()
}

/// Asserts that a batch has the numbers of a plain one.
pub(crate) fn assert_formed<T: Scalar>(
    batch: &Batch<T>,
    plain: &Batch<f64>,
    Normalizers { observation, goal }: Normalizers<'_>,
    joined_goal: Option<JoinedGoal>,
) -> Result {
    let is_relative = joined_goal == Some(JoinedGoal::Relative);
    let (of_columns, of_inputs) = if is_relative { (None, goal) } else { (goal, goal) };
    let observations = formed::<T>(plain.observation(), observation)?;
    let next_observations = formed::<T>(plain.next_observation(), observation)?;
    let goals = formed::<T>(plain.desired_goal(), of_columns)?;
    if joined_goal.is_some() {
        let goals = |achieved: &[f64]| {
            let pairs = plain.desired_goal().iter().zip(achieved);
            let relative: Vec<f64> = pairs
                .map(|(desired, achieved)| if is_relative { desired - achieved } else { *desired })
                .collect();
            formed::<T>(&relative, of_inputs)
        };
        assert!(batch.observation().is_empty() && batch.next_observation().is_empty());
        assert_eq!(batch.input(), joined(&observations, &goals(plain.achieved_goal())?));
        assert_eq!(
            batch.next_input(),
            joined(&next_observations, &goals(plain.next_achieved_goal())?)
        );
    } else {
        assert!(batch.input().is_empty() && batch.next_input().is_empty());
        assert_eq!(batch.observation(), observations);
        assert_eq!(batch.next_observation(), next_observations);
    }
    assert_eq!(batch.desired_goal(), goals);
    assert_eq!(batch.achieved_goal(), formed::<T>(plain.achieved_goal(), of_columns)?);
    assert_eq!(batch.next_achieved_goal(), formed::<T>(plain.next_achieved_goal(), of_columns)?);
    for (column, expected) in [
        (batch.action(), plain.action()),
        (batch.reward(), plain.reward()),
        (batch.discount(), plain.discount()),
        (batch.importance_weight(), plain.importance_weight()),
        (batch.field("value")?, plain.field("value")?),
        (batch.field("latent")?, plain.field("latent")?),
    ] {
        assert_eq!(column, formed::<T>(expected, None)?);
    }
    assert_eq!(batch.terminated(), plain.terminated());
    assert_eq!(batch.truncated(), plain.truncated());
    assert_eq!(batch.success(), plain.success());
    assert_eq!(batch.transition(), plain.transition());
    assert_eq!(batch.goal_source(), plain.goal_source());
    Ok(())
}

fn check_forms<T: Scalar>() -> Result {
    let (buffer, [observation, goal]) = (buffer()?, normalizers()?);
    let (mut plain, mut batch) = (Batch::<f64>::new(), Batch::<T>::new());
    for sampler in samplers()? {
        sampler.sample(&buffer, &reward(), 3, &mut plain)?;
        assert!(!sampler.success() || plain.success().contains(&true));
        for joined_goal in [None, Some(JoinedGoal::Desired), Some(JoinedGoal::Relative)] {
            for [observation, goal] in [
                [None, None],
                [Some(&observation), None],
                [None, Some(&goal)],
                [Some(&observation), Some(&goal)],
            ] {
                let sampler = sampler.with_joined_goal(joined_goal);
                let normalizers = Normalizers { observation, goal };
                let columns = ColumnsMut::default();
                sampler.sample_into(&buffer, &reward(), 3, &mut batch, normalizers, columns)?;
                assert_formed(&batch, &plain, normalizers, joined_goal)?;
            }
        }
    }
    Ok(())
}

#[test]
fn every_form_has_the_numbers_of_the_plain_batch() -> Result {
    check_forms::<f32>()?;
    check_forms::<f64>()
}

#[test]
fn normalizing_while_drawing_is_normalizing_afterwards() -> Result {
    let (buffer, [observation, goal]) = (buffer()?, normalizers()?);
    let sampler = samplers()?[0];
    let (mut plain, mut batch) = (Batch::<f64>::new(), Batch::<f64>::new());
    sampler.sample(&buffer, &reward(), 3, &mut plain)?;
    let normalizers = Normalizers { observation: Some(&observation), goal: Some(&goal) };
    let columns = ColumnsMut::default();
    sampler.sample_into(&buffer, &reward(), 3, &mut batch, normalizers, columns)?;
    let mut expected = plain.observation().to_vec();
    observation.normalize(&mut expected)?;
    assert_eq!(batch.observation(), expected);
    let mut expected = plain.desired_goal().to_vec();
    goal.normalize(&mut expected)?;
    assert_eq!(batch.desired_goal(), expected);
    // What is stored is not touched, and the next draw need not be normalized.
    sampler.sample(&buffer, &reward(), 3, &mut batch)?;
    assert_eq!(batch, plain);
    Ok(())
}

#[test]
fn a_normalizer_of_other_dimensions_is_refused() -> Result {
    let (buffer, [_, goal]) = (buffer()?, normalizers()?);
    let mut batch = Batch::<f32>::new();
    let normalizers = Normalizers { observation: Some(&goal), goal: None };
    let (sampler, columns) = (samplers()?[0], ColumnsMut::default());
    let result = sampler.sample_into(&buffer, &reward(), 3, &mut batch, normalizers, columns);
    let error = result.unwrap_err();
    assert_eq!(error, SampleError::NormalizerDim { expected: 5, actual: 3 });
    assert!(batch.is_empty());
    let wrong = NormalizerError::WrongTarget { len: 2, rows: 3 };
    assert_eq!(goal.normalize_into(&[0.0; 3], &mut [0.0_f32; 2]), Err(wrong));
    Ok(())
}

#[test]
fn outcomes_are_computed_from_the_buffer_s_own_numbers() -> Result {
    // 0.05 is the threshold, which counts as missed; the nearest f32 is a little more than 0.05.
    let dims = Dims { observation: 1, goal: 1, action: 1 };
    let mut buffer = HerBuffer::<f64>::new(BufferConfig::new(9, dims))?;
    let below = 0.05_f64.next_down();
    buffer.add_episode(&EpisodeData {
        observation: &[0.0, 0.0],
        achieved_goal: &[0.0, below],
        desired_goal: &[0.0],
        action: &[0.0],
        reward: &[0.0],
        terminated: false,
        truncated: true,
        fields: &[],
    })?;
    let sampler = Sampler::new(1, GoalStrategy::PastDesired, UnitInterval::ONE).with_success(true);
    let mut batch = Batch::<f32>::new();
    sampler.sample(&buffer, &DistanceReward::sparse(), 0, &mut batch)?;
    assert_eq!((batch.success(), batch.reward()), (&[true][..], &[0.0][..]));
    let rounded = f64::from(batch.next_achieved_goal()[0]);
    assert!(!DistanceReward::sparse().is_success(&[rounded], &[0.0]));
    Ok(())
}

#[test]
fn the_discount_needs_no_window_and_is_zero_where_the_task_ended() -> Result {
    let (buffer, mut batch) = (buffer()?, Batch::<f32>::new());
    let sampler = samplers()?[0];
    for gamma in [1.0, 0.98] {
        let discounted = sampler.with_discount(UnitInterval::new(gamma)?);
        assert_eq!(discounted.discount().map(UnitInterval::get), Some(gamma));
        discounted.sample(&buffer, &reward(), 3, &mut batch)?;
        assert!(batch.terminated().contains(&true) && batch.terminated().contains(&false));
        for (discount, terminated) in batch.discount().iter().zip(batch.terminated()) {
            assert_eq!(*discount, if *terminated { 0.0 } else { gamma as f32 });
        }
    }
    // It is the discount of the windows.
    let windows = samplers()?[2];
    let n_step = windows.with_discount(UnitInterval::ONE).n_step();
    let steps = windows.n_step().map(|n_step| n_step.steps());
    assert_eq!(n_step, steps.map(|steps| NStep::new(steps, UnitInterval::ONE)));
    Ok(())
}

#[test]
fn columns_go_to_memory_of_the_caller_s() -> Result {
    let buffer = buffer()?;
    for sampler in samplers()? {
        let sampler =
            sampler.with_joined_goal(JoinedGoal::Desired).with_discount(UnitInterval::new(0.9)?);
        let (mut whole, mut rest) = (Batch::<f32>::new(), Batch::<f32>::new());
        sampler.sample(&buffer, &reward(), 3, &mut whole)?;
        // A batch that has been used still has columns of its own.
        sampler.sample(&buffer, &reward(), 4, &mut rest)?;
        let width = DIMS.observation + DIMS.goal;
        let mut inputs = [vec![f32::NAN; ROWS * width], vec![f32::NAN; ROWS * width]];
        let mut rewards = [f32::NAN; ROWS];
        let mut terminated = [false; ROWS];
        let [input, next_input] = &mut inputs;
        let columns = ColumnsMut {
            input,
            next_input,
            reward: &mut rewards,
            terminated: &mut terminated,
            ..ColumnsMut::default()
        };
        sampler.sample_into(&buffer, &reward(), 3, &mut rest, Normalizers::default(), columns)?;
        assert_eq!(inputs[0], whole.input());
        assert_eq!(inputs[1], whole.next_input());
        assert_eq!(rewards, whole.reward());
        assert_eq!(terminated, whole.terminated());
        assert!(rest.input().is_empty() && rest.next_input().is_empty());
        assert!(rest.reward().is_empty() && rest.terminated().is_empty());
        assert_eq!(rest.len(), ROWS);
        assert_eq!(rest.discount(), whole.discount());
        assert_eq!(rest.desired_goal(), whole.desired_goal());
        assert_eq!(rest.transition(), whole.transition());
        assert_eq!(rest.field("latent")?, whole.field("latent")?);
        // It gets its columns back.
        sampler.sample(&buffer, &reward(), 3, &mut rest)?;
        assert_eq!(rest, whole);
    }
    Ok(())
}

#[test]
fn memory_of_a_wrong_length_is_refused() -> Result {
    let (buffer, mut batch) = (buffer()?, Batch::<f32>::new());
    let sampler = samplers()?[0].with_batch_size(2);
    let mut memory = [0.0_f32; 9];
    let mut refusal = |sampler: Sampler, columns: ColumnsMut<'_, f32>| {
        let none = Normalizers::default();
        let result = sampler.sample_into(&buffer, &reward(), 3, &mut batch, none, columns);
        assert!(batch.is_empty());
        result.unwrap_err()
    };
    let columns = ColumnsMut { observation: &mut memory, ..ColumnsMut::default() };
    let expected = SampleError::WrongLength { column: "observation", expected: 10, actual: 9 };
    assert_eq!(refusal(sampler, columns), expected);
    let columns = ColumnsMut { discount: &mut memory[..2], ..ColumnsMut::default() };
    let expected = SampleError::WrongLength { column: "discount", expected: 0, actual: 2 };
    assert_eq!(refusal(sampler, columns), expected);
    let columns = ColumnsMut { next_observation: &mut memory, ..ColumnsMut::default() };
    let expected = SampleError::WrongLength { column: "next_observation", expected: 0, actual: 9 };
    assert_eq!(refusal(sampler.with_joined_goal(JoinedGoal::Desired), columns), expected);
    Ok(())
}

#[test]
fn columns_are_taken_and_given_back() -> Result {
    let buffer = buffer()?;
    let sampler = samplers()?[1];
    let (mut batch, mut whole) = (Batch::<f32>::new(), Batch::<f32>::new());
    sampler.sample(&buffer, &reward(), 3, &mut batch)?;
    sampler.sample(&buffer, &reward(), 3, &mut whole)?;
    let mut columns = batch.take_columns();
    assert_eq!(columns.observation, whole.observation());
    assert_eq!(columns.success, whole.success());
    assert!(batch.observation().is_empty());
    assert_eq!(batch.len(), ROWS);
    assert_eq!(batch.field("value")?, whole.field("value")?);
    let kept = std::mem::take(&mut columns.observation);
    batch.give_back(columns);
    assert!(batch.is_empty() && batch.reward().is_empty());
    sampler.sample(&buffer, &reward(), 3, &mut batch)?;
    assert_eq!(batch, whole);
    assert_eq!(kept, whole.observation());
    Ok(())
}
