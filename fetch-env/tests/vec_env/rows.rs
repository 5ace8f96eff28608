//! Rows of observations: each is written and copied to its own place.

use fetch_env::{
    BatchObservation, BoxSpace, Env, Space, make_kinematic,
    vec_env::{ArrayRows, GoalRows, Rows, VecEnvError, WriteRow},
};

use crate::common::Result;

#[test]
fn arrays_are_written_and_copied_row_by_row() -> Result {
    let space = Space::from(BoxSpace::<f32>::unbounded(2)?);
    let mut rows = ArrayRows::<f32>::new(&space, 3)?;
    for row in 0..3_u8 {
        rows.write_row(row.into(), &[f32::from(row), 10.0 + f32::from(row)])?;
    }
    assert_eq!(rows.array(3), [0.0, 10.0, 1.0, 11.0, 2.0, 12.0]);
    let mut other = ArrayRows::<f32>::new(&space, 3)?;
    other.copy_row(0, &rows, 2);
    other.copy_row(2, &rows, 1);
    assert_eq!((&other.array(3)[..2], &other.array(3)[4..]), (&[2.0, 12.0][..], &[1.0, 11.0][..]));
    assert!(other.array(3)[2..4].iter().all(|element| element.is_nan()));
    assert_eq!(other.value(0), rows.value(2));
    Ok(())
}

#[test]
fn goals_are_written_and_copied_row_by_row() -> Result {
    let mut env = make_kinematic("FetchPush-v4")?;
    let space = env.observation_space().clone();
    let mut rows = GoalRows::<f64>::new(&space, 3)?;
    let mut observations = Vec::new();
    for row in 0..3 {
        let start = env.reset(Some(row as u64))?.observation;
        rows.write_row(row, &start)?;
        observations.push(start);
    }
    let mut other = GoalRows::<f64>::new(&space, 3)?;
    (0..3).for_each(|row| other.copy_row(row, &rows, 2 - row));
    for (row, start) in observations.iter().enumerate() {
        let value = start.to_value(&space)?;
        assert_eq!((rows.value(row), other.value(2 - row)), (value.clone(), value));
    }
    let wrong = GoalRows::<f32>::new(&space, 3).err();
    let expected = VecEnvError::ObservationSpace { key: "observation", element: "f32" };
    assert_eq!(wrong, Some(expected));
    Ok(())
}
