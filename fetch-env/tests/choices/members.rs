//! What a discrete space contains, and how its members are drawn from random words.

use std::convert::Infallible;

use fetch_env::{
    ActionSpace, BoxSpace, DiscreteSpace, EnvError, MultiBinarySpace, MultiDiscreteSpace, NpRandom,
    Space,
    spaces::{SpaceError, Value},
};
use rand_core::{TryRng, utils::fill_bytes_via_next_word};

use crate::Result;

/// A generator of these words.
struct Words(Vec<u64>);

impl TryRng for Words {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.0.remove(0) as u32)
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.0.remove(0))
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        fill_bytes_via_next_word(bytes, || self.try_next_u64())
    }
}

#[test]
fn a_choice_takes_another_word_only_if_the_first_one_is_left_over() -> Result {
    let space = DiscreteSpace::from_start(3, 10)?;
    // 2^64 is three times as many words as each choice gets, and one more: the word 0.
    let mut words = Words(vec![0, u64::MAX, 1, 1 << 63]);
    assert_eq!(space.sample(&mut words), [12]);
    // Three times the second word is 1 modulo 2^64, the least product that is kept.
    words.0.insert(1, 0xaaaa_aaaa_aaaa_aaab);
    assert_eq!([0; 3].map(|_| space.sample(&mut words)[0]), [10, 12, 11]);
    assert!(words.0.is_empty());
    Ok(())
}

#[test]
fn answers_are_the_bits_of_words() -> Result {
    let mut words = Words(vec![0b101, 1]);
    let answers = MultiBinarySpace::new(vec![5, 13])?.sample(&mut words);
    let yes: Vec<_> = (0..answers.len()).filter(|at| answers[*at]).collect();
    assert_eq!(yes, [0, 2, 64]);
    Ok(())
}

#[test]
fn a_space_contains_its_choices_and_no_others() -> Result {
    let space = DiscreteSpace::from_start(3, -1)?;
    assert_eq!((space.n(), space.start(), space.last(), space.action_len()), (3, -1, 1, 1));
    for choice in -3..=3 {
        let is_inside = (-1..=1).contains(&choice);
        assert_eq!(space.contains(&[choice]), is_inside, "{choice}");
        assert_eq!(space.check_action(&[choice]).is_ok(), is_inside, "{choice}");
        assert_eq!(Space::from(space).contains(&Value::I64(vec![choice])), is_inside, "{choice}");
    }
    assert!(!space.contains(&[]) && !space.contains(&[0, 0]));
    assert_eq!(space.invalid_elements(0), [-2, 2]);
    // The largest choice may be the largest integer.
    for (n, start) in [(1, i64::MAX), (2, i64::MAX - 1), (u64::MAX, i64::MIN + 1)] {
        let space = DiscreteSpace::from_start(n, start)?;
        assert_eq!(space.last(), i64::MAX);
        assert_eq!(space.invalid_elements(0), [start - 1]);
    }

    let space = MultiDiscreteSpace::from_start(vec![2, 4], vec![0, 5])?;
    assert_eq!((space.len(), space.is_empty()), (2, false));
    assert!(MultiDiscreteSpace::new(vec![])?.is_empty());
    assert!(space.contains(&[1, 8]) && !space.contains(&[1, 9]) && !space.contains(&[8, 1]));
    assert!(!space.contains(&[1]) && !space.contains(&[1, 8, 0]));
    assert_eq!(space.invalid_elements(1), [4, 9]);

    let space = MultiBinarySpace::new(vec![2, 3])?;
    assert_eq!((space.shape(), space.len(), space.is_empty()), (&[2, 3][..], 6, false));
    assert_eq!(space.action_len(), 6);
    assert!(space.contains(&[true; 6]) && !space.contains(&[true; 5]));
    assert_eq!(space.check_action(&[true; 6]), Ok(()));
    let refusal = EnvError::ActionLength { expected: 6, actual: 7 };
    assert_eq!(space.check_action(&[true; 7]), Err(refusal));
    assert!(space.invalid_elements(0).is_empty());
    Ok(())
}

/// Sampling an action is sampling the space, and needs a slice of the right length.
fn ensure_samples_actions<A: ActionSpace>(space: &A, sample: &[A::Element], seed: u64) {
    let mut action = vec![A::Element::default(); space.action_len()];
    space.sample_action(&mut NpRandom::new(seed), &mut action).expect("the right length");
    assert_eq!(action, sample);
    for actual in [action.len() - 1, action.len() + 1] {
        let refusal = SpaceError::SampleLength { expected: action.len(), actual };
        let mut other = vec![A::Element::default(); actual];
        assert_eq!(space.sample_action(&mut NpRandom::new(seed), &mut other), Err(refusal));
    }
}

#[test]
fn an_action_is_a_sample() -> Result {
    for seed in 0..10 {
        let random = || NpRandom::new(seed);
        let space = DiscreteSpace::from_start(1000, -3)?;
        ensure_samples_actions(&space, &space.sample(&mut random()), seed);
        let space = MultiDiscreteSpace::new(vec![1000, 2, 3])?;
        ensure_samples_actions(&space, &space.sample(&mut random()), seed);
        let space = MultiBinarySpace::new(vec![3, 7])?;
        ensure_samples_actions(&space, &space.sample(&mut random()), seed);
        let space = BoxSpace::uniform(vec![4], -1.0_f32, 1.0)?;
        ensure_samples_actions(&space, &space.sample(&mut random()), seed);
    }
    Ok(())
}
