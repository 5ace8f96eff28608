//! Rows of observations: each is written and copied to its own place.

use fetch_env::{
    BatchObservation, BoxSpace, Env, FetchObservation, Space, make_kinematic,
    spaces::SpaceError,
    vec_env::{ArrayRows, GoalRows, Rows},
    wrappers::GoalVector,
};

use crate::common::Result;

/// Writes observations to rows, and copies these in reverse order.
fn written_and_copied<O: BatchObservation>(
    space: &Space,
    observations: &[O; 3],
) -> Result<[O::Rows; 2]> {
    let (mut rows, mut reversed) = (O::Rows::new(space, 3)?, O::Rows::new(space, 3)?);
    for (row, observation) in observations.iter().enumerate() {
        rows.write_row(row, observation)?;
    }
    (0..3).for_each(|row| reversed.copy_row(row, &rows, 2 - row));
    for (row, observation) in observations.iter().enumerate() {
        let value = observation.to_value(space)?;
        assert_eq!((rows.value(row), reversed.value(2 - row)), (value.clone(), value));
    }
    Ok([rows, reversed])
}

#[test]
fn arrays_are_written_and_copied_row_by_row() -> Result {
    let space = Space::from(BoxSpace::<f32>::unbounded(2)?);
    let [rows, reversed] =
        written_and_copied(&space, &[[0.0_f32, 10.0], [1.0, 11.0], [2.0, 12.0]])?;
    assert_eq!(rows.array(3), [0.0, 10.0, 1.0, 11.0, 2.0, 12.0]);
    assert_eq!(reversed.array(2), [2.0, 12.0, 1.0, 11.0]);
    // The rows next to the copied one stay unwritten.
    let mut other: ArrayRows<f32> = Rows::<[f32; 2]>::new(&space, 3)?;
    Rows::<[f32; 2]>::copy_row(&mut other, 1, &rows, 2);
    assert_eq!(other.array(3)[2..4], [2.0, 12.0]);
    let beside = [&other.array(3)[..2], &other.array(3)[4..]].concat();
    assert!(beside.iter().all(|element| element.is_nan()));
    Ok(())
}

#[test]
fn goals_are_written_and_copied_row_by_row() -> Result {
    let mut env = make_kinematic("FetchPush-v4")?;
    let space = env.observation_space().clone();
    let starts = [0, 1, 2].map(|seed| env.reset(Some(seed)).expect("a reset").observation);
    written_and_copied(&space, &starts)?;
    // The space has numbers of double precision.
    type Single = GoalVector<FetchObservation, f32>;
    let wrong = <GoalRows<f32> as Rows<Single>>::new(&space, 3).err();
    let expected = SpaceError::MissingPart { key: "observation", element: "f32" };
    assert_eq!(wrong, Some(expected));
    Ok(())
}
