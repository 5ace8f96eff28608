//! Rows with numbers are recorded once, in order, and an episode goes on only where it is.

use her_relabel::{AddError, HerBuffer, RowNumbers, StartData, StepData, StepRows};

use crate::common::{Result, achieved_goal, action, desired_goal, observation, reward};
use crate::step_rows::{Columns, NUM_ENVS, Row, buffer, reset_row, saved, step_row};

/// Records rows with the numbers of the vectorized environments 7.
fn record(buffer: &mut HerBuffer<f64>, rows: &[Row], numbers: &[u64]) -> Result<(), AddError> {
    record_from(7, buffer, rows, numbers)
}

fn record_from(
    source: u64,
    buffer: &mut HerBuffer<f64>,
    rows: &[Row],
    number: &[u64],
) -> Result<(), AddError> {
    let columns = Columns::new(rows);
    let rows = StepRows { numbers: Some(RowNumbers { source, number }), ..columns.rows() };
    buffer.record(&rows).map(|recorded| assert_eq!(recorded.first_refusal, None))
}

/// Begins the episodes 1 and 2 of two environments, and records a step of each.
fn begun() -> Result<HerBuffer<f64>> {
    let mut buffer = buffer();
    record(&mut buffer, &[reset_row(0, 1), reset_row(1, 2)], &[11, 4])?;
    record(&mut buffer, &[step_row(0, (1, 0)), step_row(1, (2, 0))], &[12, 5])?;
    Ok(buffer)
}

#[test]
fn each_row_is_recorded_once_and_in_order() -> Result {
    let mut buffer = begun()?;
    let before = saved(&buffer);
    let rows = [step_row(1, (2, 1)), step_row(0, (1, 1))];
    let twice = |env_index| Err(AddError::RecordedBefore { env_index });
    let missing = |env_index, missing| Err(AddError::RowsMissing { env_index, missing });
    for (numbers, refused) in [
        ([6, 12], twice(0)),
        ([5, 13], twice(1)),
        ([0, 13], twice(1)),
        ([7, 13], missing(1, 1)),
        ([6, u64::MAX], missing(0, u64::MAX - 13)),
    ] {
        assert_eq!(record(&mut buffer, &rows, &numbers), refused);
        assert_eq!(saved(&buffer), before);
    }
    let foreign = record_from(8, &mut buffer, &rows, &[6, 13]);
    assert_eq!(foreign, Err(AddError::OtherEpisode { env_index: 1 }));
    let columns = Columns::new(&rows);
    let short = RowNumbers { source: 7, number: &[6] };
    let short = buffer.record(&StepRows { numbers: Some(short), ..columns.rows() });
    assert!(matches!(short, Err(AddError::WrongLength { expected: 2, actual: 1, .. })));
    assert_eq!(saved(&buffer), before);
    record(&mut buffer, &rows, &[6, 13])?;
    assert_eq!(buffer.unfinished_steps(0)?, Some(2));
    Ok(())
}

#[test]
fn rows_before_a_start_may_be_left_out() -> Result {
    let mut buffer = begun()?;
    record(&mut buffer, &[reset_row(0, 3)], &[40])?;
    assert_eq!((buffer.len(), buffer.unfinished_steps(0)?), (1, Some(0)));
    let twice = record(&mut buffer, &[reset_row(0, 3)], &[40]);
    assert_eq!(twice, Err(AddError::RecordedBefore { env_index: 0 }));
    record(&mut buffer, &[step_row(0, (3, 0))], &[41])?;
    // A row that only repeats, such as that of an environment that a reset left out, has any number.
    record(&mut buffer, &[Row { env: 0, ..Row::default() }], &[41])?;
    // Environments that others replace begin with a reset.
    record_from(8, &mut buffer, &[reset_row(0, 4)], &[1])?;
    record_from(8, &mut buffer, &[step_row(0, (4, 0))], &[2])?;
    assert_eq!(buffer.len(), 2);
    Ok(())
}

#[test]
fn a_forgotten_reset_after_the_end_of_an_episode_is_missing() -> Result {
    let mut buffer = begun()?;
    let last = Row { truncated: true, ..step_row(0, (1, 1)) };
    record(&mut buffer, &[last], &[13])?;
    let twice = record(&mut buffer, &[last], &[13]);
    assert_eq!(twice, Err(AddError::RecordedBefore { env_index: 0 }));
    let missing = record(&mut buffer, &[step_row(0, (3, 0))], &[15]);
    assert_eq!(missing, Err(AddError::RowsMissing { env_index: 0, missing: 1 }));
    // A failure is a row, too, and the steps of a discarded episode are skipped.
    record(&mut buffer, &[Row { env: 1, truncated: true, ..Row::default() }], &[6])?;
    record(&mut buffer, &[step_row(1, (2, 2))], &[9])?;
    record(&mut buffer, &[reset_row(1, 5)], &[10])?;
    record(&mut buffer, &[step_row(1, (5, 0))], &[11])?;
    assert_eq!(buffer.unfinished_steps(1)?, Some(1));
    Ok(())
}

#[test]
fn an_episode_that_was_continued_by_hand_or_loaded_is_another() -> Result {
    let other = Err(AddError::OtherEpisode { env_index: 0 });
    let row = [step_row(0, (1, 1))];
    let mut loaded = HerBuffer::read_from(&saved(&begun()?)[..])?;
    assert_eq!(record(&mut loaded, &row, &[13]), other);
    let mut by_hand = begun()?;
    by_hand.add_step(
        0,
        &StepData {
            action: &action(1, 1),
            reward: reward(1, 1),
            next_observation: &observation(1, 2),
            next_achieved_goal: &achieved_goal(1, 2),
            terminated: false,
            truncated: false,
            fields: &[],
        },
    )?;
    assert_eq!(record(&mut by_hand, &row, &[13]), other);
    let start = StartData {
        observation: &observation(1, 1),
        achieved_goal: &achieved_goal(1, 1),
        desired_goal: &desired_goal(1),
    };
    let mut begun_by_hand = begun()?;
    begun_by_hand.end_episode(0)?;
    begun_by_hand.begin_episode(0, &start)?;
    assert_eq!(record(&mut begun_by_hand, &row, &[13]), other);
    // A clone has seen the same rows.
    let mut clone = begun()?.clone();
    record(&mut clone, &row, &[13])?;
    Ok(())
}

/// Resumes with the states of the environments 0 and 1 in their episodes.
fn resume(buffer: &mut HerBuffer<f64>, states: [(u32, u32); 2], number: &[u64]) -> Result {
    let of = |state: &dyn Fn((u32, u32)) -> Vec<f64>| states.map(state).concat();
    let rows: StepRows<'_, f64> = StepRows {
        env_index: &[0, 1],
        observation: &of(&|(episode, t)| observation(episode, t).to_vec()),
        achieved_goal: &of(&|(episode, t)| achieved_goal(episode, t).to_vec()),
        desired_goal: &of(&|(episode, _)| desired_goal(episode).to_vec()),
        numbers: Some(RowNumbers { source: 9, number }),
        ..StepRows::default()
    };
    Ok(buffer.resume(&rows)?.check()?)
}

#[test]
fn an_episode_goes_on_where_it_is_and_ends_elsewhere() -> Result {
    let mut buffer = HerBuffer::read_from(&saved(&begun()?)[..])?;
    resume(&mut buffer, [(1, 1), (2, 3)], &[70, 80])?;
    assert_eq!([0, 1].map(|env| buffer.unfinished_steps(env)), [Ok(Some(1)), Ok(Some(0))]);
    assert_eq!(buffer.len(), 1);
    record_from(9, &mut buffer, &[step_row(0, (1, 1)), step_row(1, (2, 3))], &[71, 81])?;
    assert_eq!([0, 1].map(|env| buffer.unfinished_steps(env)), [Ok(Some(2)), Ok(Some(1))]);
    // What was discarded stays so until the next start, and what has not begun begins.
    buffer.discard_episode(0)?;
    buffer.end_episode(1)?;
    resume(&mut buffer, [(1, 2), (2, 4)], &[71, 81])?;
    assert_eq!([0, 1].map(|env| buffer.unfinished_steps(env)), [Ok(None), Ok(Some(0))]);
    let idle: StepRows<'_, f64> = StepRows { env_index: &[NUM_ENVS], ..StepRows::default() };
    let before = saved(&buffer);
    assert!(matches!(buffer.resume(&idle), Err(AddError::WrongLength { .. })));
    assert_eq!(saved(&buffer), before);
    Ok(())
}
