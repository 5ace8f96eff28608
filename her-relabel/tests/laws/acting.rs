//! A network sees the same bits while acting as while learning.

use crate::common::{Result, Telling};
use her_relabel::{
    Batch, BufferConfig, ColumnsMut, Dims, EpisodeData, GoalStrategy, HerBuffer, InputError,
    JoinedGoal, Normalizer, NormalizerConfig, Normalizers, Sampler, Scalar, StateRows,
    UnitInterval,
};
use proptest::prelude::*;

const DIMS: Dims = Dims { observation: 5, goal: 3, action: 1 };
const STEPS: usize = 6;

fn normalizer(dim: usize, seen: &[f64]) -> Result<Normalizer> {
    let mut normalizer = Normalizer::new(NormalizerConfig::new(dim).with_clip(1.5))?;
    normalizer.update(&seen[..seen.len() / dim * dim])?;
    Ok(normalizer)
}

/// Numbers that `f32` rounds, zero with a sign, and a number below the normal range of `f32`.
fn numbers(len: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(prop_oneof![-3.0..3.0, Just(0.1), Just(-0.0), Just(1e-40)], len)
}

/// Draws unrelabeled transitions of an episode of `S` for a network of `T`, and asserts that acting
/// in their states gives their inputs.
fn assert_seen_alike<S: Scalar, T: Scalar>(
    episode: &EpisodeData<'_, f64>,
    joined_goal: JoinedGoal,
    normalizers: Normalizers<'_>,
) -> Result {
    let mut buffer = HerBuffer::<S>::new(BufferConfig::new(100, DIMS))?;
    buffer.add_episode(episode)?;
    let sampler = Sampler::new(20, GoalStrategy::Future, UnitInterval::ZERO);
    let mut stored = Batch::<S>::new();
    sampler.sample(&buffer, &Telling, 5, &mut stored)?;
    let mut drawn = Batch::<T>::new();
    sampler.with_joined_goal(joined_goal).sample_into(
        &buffer,
        &Telling,
        5,
        &mut drawn,
        normalizers,
        ColumnsMut::default(),
    )?;
    let before = StateRows {
        observation: stored.observation(),
        achieved_goal: stored.achieved_goal(),
        desired_goal: stored.desired_goal(),
    };
    let after = StateRows {
        observation: stored.next_observation(),
        achieved_goal: stored.next_achieved_goal(),
        desired_goal: stored.desired_goal(),
    };
    let bits = |numbers: &[T]| numbers.iter().map(|number| number.bits()).collect::<Vec<_>>();
    for (states, expected) in [(before, drawn.input()), (after, drawn.next_input())] {
        let mut input = vec![T::from_f64(f64::NAN); expected.len()];
        normalizers.write_input(joined_goal, DIMS, &states, &mut input)?;
        assert_eq!(bits(&input), bits(expected));
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn acting_sees_the_bits_that_learning_sees(
        observation in numbers((STEPS + 1) * DIMS.observation),
        achieved_goal in numbers((STEPS + 1) * DIMS.goal),
        desired_goal in numbers(DIMS.goal),
    ) {
        let episode = EpisodeData {
            observation: &observation,
            achieved_goal: &achieved_goal,
            desired_goal: &desired_goal,
            action: &[0.0; STEPS],
            reward: &[0.0; STEPS],
            terminated: false,
            truncated: true,
            fields: &[],
        };
        let check = || -> Result {
            let of_observation = normalizer(DIMS.observation, &observation)?;
            let of_goal = normalizer(DIMS.goal, &achieved_goal)?;
            for joined_goal in [JoinedGoal::Desired, JoinedGoal::Relative] {
                for observation in [None, Some(&of_observation)] {
                    for goal in [None, Some(&of_goal)] {
                        let normalizers = Normalizers { observation, goal };
                        assert_seen_alike::<f32, f32>(&episode, joined_goal, normalizers)?;
                        assert_seen_alike::<f64, f32>(&episode, joined_goal, normalizers)?;
                        assert_seen_alike::<f32, f64>(&episode, joined_goal, normalizers)?;
                        assert_seen_alike::<f64, f64>(&episode, joined_goal, normalizers)?;
                    }
                }
            }
            Ok(())
        };
        prop_assert!(check().is_ok(), "{:?}", check());
    }
}

#[test]
fn wrong_lengths_and_numbers_are_refused_and_nothing_is_written() -> Result {
    let good =
        StateRows { observation: &[0.5; 10], achieved_goal: &[0.5; 6], desired_goal: &[1.0; 6] };
    let mut input = [7.0_f32; 16];
    let none = Normalizers::default();
    let wrong = |column, expected, actual| InputError::WrongLength { column, expected, actual };
    let not_finite = |column, index| InputError::NotFinite { column, index, value: f64::INFINITY };
    let mut bad = [0.5; 10];
    bad[4] = f64::INFINITY;
    for (states, error) in [
        (StateRows { observation: &bad[..9], ..good }, wrong("observation", 5, 9)),
        (StateRows { observation: &[0.5; 5], ..good }, wrong("achieved_goal", 3, 6)),
        (StateRows { achieved_goal: &[0.5; 5], ..good }, wrong("achieved_goal", 6, 5)),
        (StateRows { desired_goal: &[], ..good }, wrong("desired_goal", 6, 0)),
        (StateRows { observation: &bad, ..good }, not_finite("observation", 4)),
        (StateRows { achieved_goal: &bad[..6], ..good }, not_finite("achieved_goal", 4)),
        (StateRows { desired_goal: &bad[2..8], ..good }, not_finite("desired_goal", 2)),
    ] {
        assert_eq!(none.write_input(JoinedGoal::Desired, DIMS, &states, &mut input), Err(error));
    }
    let short = none.write_input(JoinedGoal::Desired, DIMS, &good, &mut input[..15]);
    assert_eq!(short, Err(wrong("input", 16, 15)));
    let other = normalizer(4, &[])?;
    for (normalizers, expected) in [
        (Normalizers { observation: Some(&other), goal: None }, 5),
        (Normalizers { observation: None, goal: Some(&other) }, 3),
    ] {
        let refused = normalizers.write_input(JoinedGoal::Relative, DIMS, &good, &mut input);
        assert_eq!(refused, Err(InputError::NormalizerDim { expected, actual: 4 }));
    }
    assert_eq!(input, [7.0; 16]);
    // Lengths of 0 have no numbers, and panic nowhere.
    let empty = StateRows::<f64> { observation: &[], achieved_goal: &[], desired_goal: &[] };
    let dims = Dims { observation: 0, goal: 0, action: 0 };
    none.write_input(JoinedGoal::Relative, dims, &empty, &mut input[..0])?;
    none.write_input(JoinedGoal::Relative, DIMS, &empty, &mut input[..0])?;
    let goalless = StateRows { achieved_goal: &[], desired_goal: &[], ..good };
    none.write_input(JoinedGoal::Relative, Dims { goal: 0, ..DIMS }, &goalless, &mut input[..10])?;
    assert_eq!(input[9..11], [0.5, 7.0]);
    Ok(())
}
