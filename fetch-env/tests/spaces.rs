//! Laws of spaces.

use fetch_env::{
    BoxSpace, DictSpace, EnvExt, MultiBinarySpace, Space, make_kinematic,
    spaces::{ImageSpace, SpaceError, Value},
    wrappers::FrameStack,
};
use proptest::prelude::*;
use rand_pcg::Pcg64;
use testing::Result;

/// Bounds of any kind, including infinite ones.
fn interval() -> impl Strategy<Value = (f64, f64)> {
    let bound = || prop_oneof![3 => -1e6..1e6, 1 => Just(f64::MIN), 1 => Just(f64::MAX)];
    (bound(), bound(), any::<bool>(), any::<bool>()).prop_map(
        |(a, b, below, above): (f64, f64, bool, bool)| {
            let low = if below { a.min(b) } else { f64::NEG_INFINITY };
            let high = if above { a.max(b) } else { f64::INFINITY };
            (low, high)
        },
    )
}

fn box_f64() -> impl Strategy<Value = BoxSpace<f64>> {
    prop::collection::vec(interval(), 0..6).prop_map(|intervals| {
        let (low, high): (Vec<_>, Vec<_>) = intervals.into_iter().unzip();
        BoxSpace::new(vec![low.len()], low, high).expect("low <= high")
    })
}

/// Converts a space to single precision, in which the largest numbers would round to infinity.
fn narrowed(space: &BoxSpace<f64>) -> BoxSpace<f32> {
    let narrow = |bounds: &[f64], finite: f32| -> Vec<f32> {
        bounds.iter().map(|&x| if x.abs() > 1e30 { finite } else { x as f32 }).collect()
    };
    let (low, high) = (narrow(space.low(), f32::MIN), narrow(space.high(), f32::MAX));
    let low = low.iter().zip(&high).map(|(low, high)| low.min(*high)).collect();
    BoxSpace::new(space.shape().to_vec(), low, high).expect("low <= high")
}

proptest! {
    #[test]
    fn samples_lie_in_their_space_and_depend_only_on_the_generator(space in box_f64(), seed: u64) {
        let mut rng = Pcg64::new(seed.into(), 0);
        let mut same = rng.clone();
        let single = narrowed(&space);
        for _ in 0..20 {
            let sample = space.sample(&mut rng);
            prop_assert!(space.contains(&sample), "{:?} is not in {:?}", sample, space);
            let mut buffer = vec![0.0; space.len()];
            space.sample_into(&mut same, &mut buffer)?;
            prop_assert_eq!(sample, buffer);
            let sample = single.sample(&mut rng);
            prop_assert!(single.contains(&sample), "{:?} is not in {:?}", sample, single);
            single.sample(&mut same);
        }
    }

    #[test]
    fn numbers_beyond_a_bound_and_nan_lie_outside(space in box_f64(), at: prop::sample::Index) {
        prop_assume!(!space.is_empty());
        let at = at.index(space.len());
        let mut rng = Pcg64::new(0, 0);
        for outside in [space.low()[at].next_down(), space.high()[at].next_up(), f64::NAN] {
            // Nothing lies beyond infinity.
            if outside.is_infinite() && space.contains(&vec![outside; space.len()]) {
                continue;
            }
            let mut array = space.sample(&mut rng);
            array[at] = outside;
            let within = (space.low()[at]..=space.high()[at]).contains(&outside);
            prop_assert_eq!(space.contains(&array), within);
        }
        let sample = space.sample(&mut rng);
        prop_assert!(!space.contains(&sample[1..]));
        prop_assert!(!space.contains(&[&sample[..], &[0.0]].concat()));
    }

    #[test]
    fn spaces_survive_json(a in box_f64(), b in box_f64()) {
        let space: Space = DictSpace::new([
            ("single", Space::from(narrowed(&a))),
            ("double", a.into()),
            ("nested", DictSpace::new([("b", b.into())])?.into()),
        ])
        ?
        .into();
        let json = serde_json::to_string(&space)?;
        prop_assert_eq!(serde_json::from_str::<Space>(&json)?, space);
    }
}

#[test]
fn samples_have_the_distribution_of_their_interval() -> Result {
    const SAMPLES: usize = 100_000;
    const INFINITY: f64 = f64::INFINITY;
    let low = vec![-1.0, 2.0, -INFINITY, -INFINITY];
    let high = vec![3.0, INFINITY, 2.0, INFINITY];
    let space = BoxSpace::new(vec![2, 2], low, high)?;
    let mut rng = Pcg64::new(0, 0);
    let samples: Vec<_> = (0..SAMPLES).map(|_| space.sample(&mut rng)).collect();
    // Mean and variance of the distributions: uniform, exponential, its mirror image, standard
    // normal.
    for (at, (mean, variance)) in
        [(1.0, 16.0 / 12.0), (3.0, 1.0), (1.0, 1.0), (0.0, 1.0)].into_iter().enumerate()
    {
        let average = |f: &dyn Fn(f64) -> f64| {
            samples.iter().map(|sample| f(sample[at])).sum::<f64>() / SAMPLES as f64
        };
        assert!((average(&|x| x) - mean).abs() < 0.02, "mean of element {at}");
        assert!((average(&|x| (x - mean).powi(2)) - variance).abs() < 0.05, "variance of {at}");
    }
    Ok(())
}

#[test]
fn invalid_spaces_are_refused() {
    let box_of = |low, high| BoxSpace::new(vec![1], vec![low], vec![high]);
    for (low, high) in [
        (1.0, 0.0),
        (f64::NAN, 0.0),
        (0.0, f64::NAN),
        (f64::INFINITY, f64::INFINITY),
        (f64::NEG_INFINITY, f64::NEG_INFINITY),
    ] {
        let refusal = box_of(low, high);
        assert!(matches!(refusal, Err(SpaceError::EmptyInterval { index: 0, .. })), "{refusal:?}");
    }
    let refusal = BoxSpace::new(vec![2, 3], vec![0.0_f32; 6], vec![1.0; 5]);
    let counts = SpaceError::BoundCount { shape: vec![2, 3], expected: 6, low: 6, high: 5 };
    assert_eq!(refusal, Err(counts));
    let space = Space::from(BoxSpace::<f64>::unbounded(1).expect("small"));
    let refusal = DictSpace::new([("a", space.clone()), ("a", space)]);
    assert_eq!(refusal, Err(SpaceError::DuplicateKey { key: "a".into() }));
    let json = r#"{"type":"box_f64","shape":[1],"low":[2.0],"high":[1.0]}"#;
    let refusal = serde_json::from_str::<Space>(json).expect_err("an empty interval");
    assert!(refusal.to_string().contains("no number between 2 and 1"), "{refusal}");
}

#[test]
fn a_value_of_another_kind_lies_outside() -> Result {
    let space: Space = DictSpace::new([("a", BoxSpace::<f64>::unbounded(1)?.into())])?.into();
    let dict = |key: &str, value| Value::Dict(vec![(key.into(), value)]);
    assert!(space.contains(&dict("a", Value::F64(vec![0.5]))));
    assert!(!space.contains(&dict("a", Value::F32(vec![0.5]))));
    assert!(!space.contains(&dict("b", Value::F64(vec![0.5]))));
    assert!(!space.contains(&Value::F64(vec![0.5])));
    assert!(!space.contains(&Value::Dict(Vec::new())));
    assert!(space.contains(&space.sample(&mut Pcg64::new(0, 0))));
    Ok(())
}

#[test]
fn a_bounded_box_has_both_bounds_everywhere() -> Result {
    const INFINITY: f64 = f64::INFINITY;
    for (low, high, is_bounded) in [
        ([0.0, -1.0], [1.0, 1.0], true),
        ([f64::MIN, -1.0], [f64::MAX, 1.0], true),
        ([0.0, -INFINITY], [1.0, 1.0], false),
        ([0.0, -1.0], [INFINITY, 1.0], false),
        ([0.0, -INFINITY], [1.0, INFINITY], false),
    ] {
        let space = BoxSpace::new(vec![2], low.to_vec(), high.to_vec())?;
        assert_eq!(space.is_bounded(), is_bounded, "{space:?}");
        assert_eq!((space.low(), space.high()), (&low[..], &high[..]));
        assert_eq!((space.shape(), space.len(), space.is_empty()), (&[2][..], 2, false));
    }
    assert!(BoxSpace::<f64>::unbounded(0)?.is_empty());
    Ok(())
}

#[test]
fn an_unbounded_box_is_written_with_null() -> Result {
    let space = Space::from(BoxSpace::<f64>::unbounded(1)?);
    let json = serde_json::to_string(&space)?;
    assert_eq!(json, r#"{"type":"box_f64","shape":[1],"low":[null],"high":[null]}"#);
    Ok(())
}

/// Shapes with too many elements; in the last two the product exceeds a `usize`, which would wrap
/// to 0.
const HUGE: [[usize; 3]; 5] = [
    [1, 1 << 28, 2],
    [(1 << 28) + 1, 1, 1],
    [usize::MAX, 1, 1],
    [1 << 32, 1 << 32, 1],
    [1 << 30, 1 << 30, 1 << 30],
];

#[test]
fn a_space_of_too_many_elements_is_refused() -> Result {
    let largest = 1 << 28;
    for shape in HUGE {
        let refusal = SpaceError::TooLarge { shape: shape.to_vec(), most: largest };
        let uniform = BoxSpace::uniform(shape.to_vec(), 0.0_f64, 1.0);
        assert_eq!(uniform, Err(refusal.clone()));
        assert_eq!(BoxSpace::<f32>::new(shape.to_vec(), vec![], vec![]), Err(refusal.clone()));
        assert_eq!(MultiBinarySpace::new(shape.to_vec()), Err(refusal.clone()));
        assert_eq!(ImageSpace::new(shape), Err(refusal.clone()));
        for kind in [r#""box_f64","low":[],"high":[]"#, r#""multi_binary""#, r#""image""#] {
            let json = format!(r#"{{"type":{kind},"shape":{shape:?}}}"#);
            let error = serde_json::from_str::<Space>(&json).expect_err("a refusal").to_string();
            assert!(error.starts_with(&refusal.to_string()), "{error}");
        }
    }
    let refusal = BoxSpace::<f32>::unbounded(largest + 1);
    assert!(matches!(refusal, Err(SpaceError::TooLarge { .. })), "{refusal:?}");
    let many = std::num::NonZeroUsize::MAX;
    assert!(make_kinematic("FetchReach-v4")?.wrap(FrameStack::new(many)).is_err());
    assert_eq!(MultiBinarySpace::new(vec![largest])?.len(), largest);
    assert_eq!(ImageSpace::new([1 << 14, 1 << 14, 1])?.len(), largest);
    assert!(MultiBinarySpace::new(vec![1 << 40, 0])?.is_empty());
    Ok(())
}

#[test]
fn an_image_space_has_the_bytes_of_its_shape() -> Result {
    let space = ImageSpace::new([2, 3, 5])?;
    assert_eq!((space.shape(), space.len(), space.is_empty()), ([2, 3, 5], 30, false));
    let empty = ImageSpace::new([2, 0, 5])?;
    assert_eq!((empty.len(), empty.is_empty()), (0, true));
    assert!(space.contains(&[7; 30]) && empty.contains(&[]));
    assert!(!space.contains(&[7; 29]) && !space.contains(&[7; 31]));

    let mut rng = Pcg64::new(0, 0);
    let [first, second] = [space.sample(&mut rng), space.sample(&mut rng)];
    assert!(space.contains(&first) && first != second);
    // All bytes occur, each about as often as another.
    let bytes: Vec<u8> = (0..2000).flat_map(|_| space.sample(&mut rng)).collect();
    for byte in 0..=u8::MAX {
        let count = bytes.iter().filter(|other| **other == byte).count();
        assert!((150..330).contains(&count), "{count} times {byte}");
    }

    let space = Space::from(space);
    assert!(space.contains(&Value::U8(first)) && !space.contains(&Value::U8(vec![0; 29])));
    assert!(space.contains(&space.sample(&mut rng)));
    let json = r#"{"type":"image","shape":[2,3,5]}"#;
    assert_eq!(serde_json::to_string(&space)?, json);
    assert_eq!(serde_json::from_str::<Space>(json)?, space);
    Ok(())
}
