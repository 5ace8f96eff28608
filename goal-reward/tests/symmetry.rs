//! Mirrors: mirroring twice is the identity, and rules that are not their own inverse are refused.

use goal_reward::{Mirror, Mirrored, SymmetryError};
use proptest::prelude::*;

/// Rules for some elements: each kept, negated or mirrored across a plane, and some pairs swapped.
fn mirror() -> impl Strategy<Value = Mirror> {
    let rule = (0..3_u8, -2.0..2.0_f64, any::<bool>());
    prop::collection::vec(rule, 1..12).prop_map(|rules| {
        let mut elements = Vec::new();
        for (kind, plane, is_swapped) in rules {
            let first = elements.len();
            let sources = if is_swapped { vec![first + 1, first] } else { vec![first] };
            elements.extend(sources.into_iter().map(|source| match kind {
                0 => Mirrored::same(source),
                1 => Mirrored::negated(source),
                _ => Mirrored::across(source, plane),
            }));
        }
        Mirror::new(elements).expect("its own inverse")
    })
}

fn mirrored(mirror: &Mirror, vector: &[f64]) -> Vec<f64> {
    let mut mirrored = vec![f64::NAN; vector.len()];
    mirror.write(vector, &mut mirrored).expect("equal lengths");
    mirrored
}

proptest! {
    #[test]
    fn twice_is_the_identity(mirror in mirror(), numbers in prop::collection::vec(-3.0..3.0, 24)) {
        let vector = &numbers[..mirror.len()];
        let twice = mirrored(&mirror, &mirrored(&mirror, vector));
        for (twice, once) in twice.iter().zip(vector) {
            prop_assert!((twice - once).abs() < 1e-14, "{twice} {once}");
        }
    }

    #[test]
    fn distances_stay(mirror in mirror(), numbers in prop::collection::vec(-3.0..3.0, 48)) {
        let (one, other) = (&numbers[..mirror.len()], &numbers[24..24 + mirror.len()]);
        let distance = goal_reward::goal_distance(one, other);
        let [one, other] = [one, other].map(|vector| mirrored(&mirror, vector));
        prop_assert!((goal_reward::goal_distance(&one, &other) - distance).abs() < 1e-13);
    }

    #[test]
    fn mirrors_follow_each_other(one in mirror(), other in mirror()) {
        let numbers: Vec<f64> = (0..one.len() + other.len()).map(|at| at as f64).collect();
        let (front, back) = numbers.split_at(one.len());
        let parts = [mirrored(&one, front), mirrored(&other, back)].concat();
        let whole = one.clone().followed_by(&other);
        prop_assert_eq!(mirrored(&whole, &numbers), parts);
        prop_assert_eq!(Mirror::new(whole.elements()), Ok(whole));
    }
}

#[test]
fn an_element_that_stays_keeps_its_bits() {
    let mirror = Mirror::new([Mirrored::same(1), Mirrored::same(0), Mirrored::negated(2)]);
    let numbers = mirrored(&mirror.expect("its own inverse"), &[-0.0, 1e-320, 0.0]);
    assert_eq!(numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), {
        [1e-320, -0.0_f64, -0.0].map(f64::to_bits)
    });
}

#[test]
fn what_is_not_its_own_inverse_is_refused() {
    let not_inverse = |index, from| Err(SymmetryError::NotInverse { index, from });
    for (elements, error) in [
        (
            vec![Mirrored::same(0), Mirrored::negated(2)],
            Err(SymmetryError::Outside { index: 1, from: 2, len: 2 }),
        ),
        // The same source twice, a cycle of three, a different sign on the way back, another plane.
        (vec![Mirrored::same(0), Mirrored::same(0)], not_inverse(1, 0)),
        (vec![Mirrored::same(1), Mirrored::same(2), Mirrored::same(0)], not_inverse(0, 1)),
        (vec![Mirrored::same(1), Mirrored::negated(0)], not_inverse(0, 1)),
        (vec![Mirrored::across(1, 0.5), Mirrored::across(0, 0.75)], not_inverse(0, 1)),
    ] {
        assert_eq!(Mirror::new(elements), error);
    }
    for plane in [f64::NAN, f64::INFINITY, f64::MAX] {
        let refused = Mirror::new([Mirrored::across(0, plane)]);
        assert!(matches!(refused, Err(SymmetryError::NotFinite { index: 0, .. })), "{refused:?}");
    }
    let empty = Mirror::new([]).expect("nothing to mirror");
    assert!(empty.is_empty());
    let wrong = SymmetryError::WrongLength { expected: 0, actual: 1 };
    assert_eq!(empty.write(&[], &mut [0.0]), Err(wrong));
    assert_eq!(empty.write(&[0.0], &mut []), Err(wrong));
}
