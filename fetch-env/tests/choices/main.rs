//! Laws of discrete spaces.

mod members;
mod switches;

use fetch_env::{
    ActionSpace, DiscreteSpace, EnvError, MultiBinarySpace, MultiDiscreteSpace, NpRandom, Space,
    spaces::{SpaceError, Value},
};
use proptest::prelude::*;
pub(crate) use testing::Result;

/// Any number of choices that `i64` can hold, the extremes included.
fn discrete() -> impl Strategy<Value = DiscreteSpace> {
    let n = prop_oneof![1..20_u64, Just(1 << 63), Just(u64::MAX), any::<u64>()];
    let start = prop_oneof![-5..5_i64, Just(i64::MIN), Just(i64::MAX), any::<i64>()];
    (n, start)
        .prop_filter_map("too many choices", |(n, start)| DiscreteSpace::from_start(n, start).ok())
}

fn multi_discrete() -> impl Strategy<Value = MultiDiscreteSpace> {
    prop::collection::vec(discrete(), 0..6).prop_map(|parts| {
        let (nvec, start): (Vec<_>, Vec<_>) =
            parts.iter().map(|part| (part.n(), part.start())).unzip();
        let space = MultiDiscreteSpace::from_start(nvec.clone(), start.clone());
        let space = space.expect("each part is valid");
        assert_eq!((space.nvec(), space.start()), (&nvec[..], &start[..]));
        space
    })
}

fn any_space() -> impl Strategy<Value = Space> {
    prop_oneof![
        discrete().prop_map(Space::from),
        multi_discrete().prop_map(Space::from),
        prop::collection::vec(0..5_usize, 0..4)
            .prop_map(|shape| Space::from(MultiBinarySpace::new(shape).expect("small"))),
    ]
}

proptest! {
    #[test]
    fn samples_lie_in_their_space_and_depend_only_on_the_seed(space in any_space(), seed: u64) {
        let (mut random, mut same) = (NpRandom::new(seed), NpRandom::new(seed));
        for _ in 0..20 {
            let sample = space.sample(&mut random);
            prop_assert!(space.contains(&sample), "{:?} is not in {:?}", sample, space);
            prop_assert_eq!(sample, space.sample(&mut same));
        }
    }

    #[test]
    fn spaces_and_their_members_survive_json(space in any_space(), seed: u64) {
        let json = serde_json::to_string(&space)?;
        prop_assert_eq!(&serde_json::from_str::<Space>(&json)?, &space);
        let sample = space.sample(&mut NpRandom::new(seed));
        let json = serde_json::to_string(&sample)?;
        prop_assert_eq!(serde_json::from_str::<Value>(&json)?, sample);
    }

    #[test]
    fn an_action_is_checked_as_the_space_contains_it(space in multi_discrete(), seed: u64) {
        let mut action = vec![0; space.action_len()];
        space.sample_action(&mut NpRandom::new(seed), &mut action)?;
        prop_assert_eq!(&action, &space.sample(&mut NpRandom::new(seed)));
        prop_assert_eq!(space.check_action(&action), Ok(()));
        for index in 0..space.len() {
            for value in space.invalid_elements(index) {
                let mut bad = action.clone();
                bad[index] = value;
                let refusal = space.check_action(&bad);
                let is_at = matches!(
                    refusal, Err(EnvError::ActionOutside { index: at, .. }) if at == index
                );
                prop_assert!(is_at, "{:?}", refusal);
                prop_assert!(!space.contains(&bad));
            }
        }
        let refusal = space.check_action(&[action, vec![0]].concat());
        let is_length = matches!(refusal, Err(EnvError::ActionLength { .. }));
        prop_assert!(is_length);
    }
}

/// Fails unless the counts are those of a uniform distribution, by a chi-square test whose
/// statistic lies within five standard deviations of its mean.
fn ensure_uniform(counts: &[u32]) {
    let expected = f64::from(counts.iter().sum::<u32>()) / counts.len() as f64;
    let square = |&count: &u32| (f64::from(count) - expected).powi(2) / expected;
    let statistic: f64 = counts.iter().map(square).sum();
    let freedom = (counts.len() - 1) as f64;
    let deviation = (statistic - freedom).abs() / (2.0 * freedom).sqrt();
    assert!(deviation < 5.0, "{statistic} with {freedom} degrees of freedom: {counts:?}");
}

#[test]
fn every_choice_is_equally_likely() -> Result {
    let mut random = NpRandom::new(1);
    for n in [2, 3, 7, 100] {
        let space = DiscreteSpace::from_start(n, -3)?;
        let mut counts = vec![0; n as usize];
        for _ in 0..1000 * n {
            counts[(space.sample(&mut random)[0] + 3) as usize] += 1;
        }
        ensure_uniform(&counts);
    }
    // Four words for three choices: without rejection one of them would be twice as likely.
    let space = DiscreteSpace::from_start(3 << 62, i64::MIN)?;
    let mut counts = [0; 3];
    for _ in 0..30_000 {
        let choice = space.sample(&mut random)[0].wrapping_sub(i64::MIN) as u64;
        counts[(choice >> 62) as usize] += 1;
    }
    ensure_uniform(&counts);
    let space = MultiBinarySpace::new(vec![13, 10])?;
    let mut counts = [[0_u32; 2]; 130];
    for _ in 0..1000 {
        for (count, answer) in counts.iter_mut().zip(space.sample(&mut random)) {
            count[usize::from(answer)] += 1;
        }
    }
    ensure_uniform(&counts.map(|[no, _]| no));
    ensure_uniform(&counts.map(|[_, yes]| yes));
    Ok(())
}

#[test]
fn invalid_spaces_are_refused() {
    let choices = |index, n, start| Some(SpaceError::Choices { index, n, start });
    assert_eq!(DiscreteSpace::new(0).err(), choices(0, 0, 0));
    assert_eq!(DiscreteSpace::from_start(2, i64::MAX).err(), choices(0, 2, i64::MAX));
    assert_eq!(MultiDiscreteSpace::new(vec![3, 0]).err(), choices(1, 0, 0));
    let counts = MultiDiscreteSpace::from_start(vec![3], vec![]);
    assert_eq!(counts, Err(SpaceError::StartCount { expected: 1, actual: 0 }));
    for json in [
        r#"{"type":"discrete","n":0,"start":0}"#,
        r#"{"type":"discrete","n":-1,"start":0}"#,
        r#"{"type":"discrete","n":2,"start":9223372036854775807}"#,
        r#"{"type":"discrete","n":2}"#,
        r#"{"type":"multi_discrete","nvec":[2],"start":[0,0]}"#,
        r#"{"type":"multi_discrete","nvec":[0],"start":[0]}"#,
        r#"{"type":"multi_binary"}"#,
    ] {
        let read = serde_json::from_str::<Space>(json);
        assert!(read.is_err(), "{json} gave {read:?}");
    }
}

#[test]
fn the_serialized_spaces_have_these_keys() -> Result {
    for (space, json) in [
        (DiscreteSpace::from_start(4, -1)?.into(), r#"{"type":"discrete","n":4,"start":-1}"#),
        (
            MultiDiscreteSpace::new(vec![2, 3])?.into(),
            r#"{"type":"multi_discrete","nvec":[2,3],"start":[0,0]}"#,
        ),
        (Space::from(MultiBinarySpace::new(vec![2])?), r#"{"type":"multi_binary","shape":[2]}"#),
    ] {
        assert_eq!(serde_json::to_string(&space)?, json);
    }
    assert_eq!(
        serde_json::to_string(&[Value::I64(vec![3]), Value::Bool(vec![true])])?,
        r#"[{"type":"i64","value":[3]},{"type":"bool","value":[true]}]"#
    );
    Ok(())
}
