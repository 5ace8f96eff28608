//! Rows that can't be recorded are refused or reported, and cost no other environment anything.

use her_relabel::{AddError, HerBuffer, Recorded, StepRows};

use crate::common::Result;
use crate::step_rows::{Columns, Row, buffer, record, record_all, reset_row, saved, step_row};

#[test]
fn a_failed_environment_loses_its_episode_and_nobody_else_s() -> Result {
    let mut buffer = buffer();
    record_all(&mut buffer, &[reset_row(0, 1), reset_row(1, 2), reset_row(2, 3)])?;
    record_all(&mut buffer, &[step_row(0, (1, 0)), step_row(1, (2, 0)), step_row(2, (3, 0))])?;
    let failed = Row { env: 1, truncated: true, ..Row::default() };
    let recorded = record(&mut buffer, &[step_row(0, (1, 1)), failed, step_row(2, (3, 1))])?;
    assert_eq!((recorded.recorded_steps, recorded.discarded_episodes), (2, 1));
    assert_eq!(recorded.first_refusal, None);
    let steps = |buffer: &HerBuffer<f64>| [0, 1, 2].map(|env| buffer.unfinished_steps(env));
    assert_eq!(steps(&buffer), [Ok(Some(2)), Ok(None), Ok(Some(2))]);
    // Its steps are skipped until its next start, also in a loaded copy.
    let mut loaded = HerBuffer::read_from(&saved(&buffer)[..])?;
    for buffer in [&mut buffer, &mut loaded] {
        let recorded = record(buffer, &[step_row(1, (2, 2))])?;
        assert_eq!((recorded.recorded_steps, recorded.skipped_steps), (0, 1));
    }
    assert_eq!(saved(&buffer), saved(&loaded));
    record_all(&mut buffer, &[reset_row(1, 4)])?;
    record_all(&mut buffer, &[step_row(1, (4, 0))])?;
    assert_eq!(steps(&buffer), [Ok(Some(2)), Ok(Some(1)), Ok(Some(2))]);
    Ok(())
}

#[test]
fn a_row_that_cannot_be_stored_is_reported_and_discards_one_episode() -> Result {
    let mut buffer = buffer();
    record_all(&mut buffer, &[reset_row(0, 1), reset_row(1, 2), reset_row(2, 3)])?;
    let bad = |env, episode| Row { bad_step: true, ..step_row(env, (episode, 0)) };
    let recorded = record(&mut buffer, &[step_row(1, (2, 0)), bad(2, 3), bad(0, 1)])?;
    let refusal = recorded.clone().check().expect_err("a refusal");
    assert_eq!(refusal.env_index, 2);
    assert!(refusal.to_string().starts_with("environment 2 has numbers"), "{refusal}");
    assert!(
        matches!(&refusal.error, AddError::NotFinite { field, index: 0, .. } if field == "reward")
    );
    assert_eq!((recorded.recorded_steps, recorded.skipped_steps), (1, 2));
    assert_eq!(recorded.discarded_episodes, 2);
    assert_eq!(buffer.unfinished_steps(1), Ok(Some(1)));
    assert_eq!(buffer.unfinished_steps(2), Ok(None));
    // A start that cannot be stored begins nothing, and the episode before it is kept.
    let recorded = record(&mut buffer, &[Row { bad_start: true, ..reset_row(1, 4) }])?;
    assert_eq!((recorded.finished_episodes, recorded.discarded_episodes), (1, 0));
    assert!(recorded.first_refusal.is_some());
    assert_eq!((buffer.len(), buffer.unfinished_steps(1)), (1, Ok(None)));
    Ok(())
}

#[test]
fn a_step_of_an_episode_that_has_not_begun_is_refused_where_it_is_recorded() -> Result {
    let mut buffer = buffer();
    let refused = |env_index| Err(AddError::NoEpisode { env_index });
    let rows = [step_row(3, (1, 0)), step_row(1, (2, 0))];
    assert_eq!(record(&mut buffer, &rows), refused(3));
    // The rows before it are not recorded either.
    record_all(&mut buffer, &[reset_row(3, 1)])?;
    assert_eq!(record(&mut buffer, &rows), refused(1));
    assert_eq!(buffer.unfinished_steps(3), Ok(Some(0)));
    // A start in the same row begins the episode after the step.
    let both = Row { start: Some(4), ..step_row(1, (2, 0)) };
    assert_eq!(record(&mut buffer, &[both]), refused(1));
    // Nor is a step after the end of an episode, however it ended.
    let last = Row { truncated: true, ..step_row(3, (1, 0)) };
    record_all(&mut buffer, &[last])?;
    assert_eq!(record(&mut buffer, &rows), refused(3));
    record_all(&mut buffer, &[reset_row(3, 5), reset_row(1, 6)])?;
    buffer.end_episode(3)?;
    assert_eq!(record(&mut buffer, &rows), refused(3));
    // What was discarded has begun.
    buffer.discard_episode(1)?;
    let recorded = record(&mut buffer, &[step_row(1, (6, 0))])?;
    assert_eq!((recorded.recorded_steps, recorded.skipped_steps), (0, 1));
    record_all(&mut buffer, &[reset_row(1, 7)])?;
    buffer.clear();
    assert_eq!(record(&mut buffer, &[step_row(1, (7, 0))])?.skipped_steps, 1);
    assert_eq!(record(&mut buffer, &rows), refused(3));
    let error = record(&mut buffer, &rows).unwrap_err();
    assert!(error.to_string().contains("record the rows of the reset"), "{error}");
    Ok(())
}

#[test]
fn wrong_lengths_and_environments_change_nothing() -> Result {
    let mut buffer = buffer();
    record_all(&mut buffer, &[reset_row(0, 1), reset_row(1, 2)])?;
    let before = saved(&buffer);
    let columns =
        Columns::new(&[step_row(0, (1, 0)), Row { start: Some(3), ..step_row(1, (2, 0)) }]);
    let good = columns.rows();
    let wrong = |field: &str, expected, actual| AddError::WrongLength {
        field: field.into(),
        expected,
        actual,
    };
    let (one, ones) = (&[true][..], &[0.5; 1][..]);
    for (bad, error) in [
        (StepRows { env_index: &[0], ..good }, wrong("stepped", 1, 2)),
        (StepRows { started: one, ..good }, wrong("started", 2, 1)),
        (StepRows { truncated: one, ..good }, wrong("truncated", 2, 1)),
        (StepRows { terminated: &[], ..good }, wrong("terminated", 2, 0)),
        (StepRows { action: &[], ..good }, wrong("action", 2, 0)),
        (StepRows { reward: ones, ..good }, wrong("reward", 2, 1)),
        (StepRows { next_observation: ones, ..good }, wrong("next_observation", 4, 1)),
        (StepRows { next_achieved_goal: ones, ..good }, wrong("next_achieved_goal", 6, 1)),
        (StepRows { next_desired_goal: ones, ..good }, wrong("next_desired_goal", 6, 1)),
        (StepRows { observation: &[], ..good }, wrong("observation", 4, 0)),
        (StepRows { achieved_goal: ones, ..good }, wrong("achieved_goal", 6, 1)),
        (StepRows { desired_goal: ones, ..good }, wrong("desired_goal", 6, 1)),
        (StepRows { env_index: &[0, 0], ..good }, AddError::RepeatedEnv { env_index: 0 }),
        (
            StepRows { env_index: &[0, 4], ..good },
            AddError::UnknownEnv { env_index: 4, num_envs: 4 },
        ),
    ] {
        assert_eq!(buffer.record(&bad), Err(error));
        assert_eq!(saved(&buffer), before);
    }
    let unknown = buffer.record(&StepRows { fields: &[("value", &[0.0; 2])], ..good });
    assert!(matches!(unknown, Err(AddError::UnknownField(_))));
    assert_eq!(saved(&buffer), before);
    buffer.record(&good)?.check()?;
    // Columns that no row reads may be empty.
    let flags = &[false; 2][..];
    let idle: StepRows<'_, f64> = StepRows {
        env_index: &[2, 3],
        stepped: flags,
        started: flags,
        truncated: flags,
        ..StepRows::default()
    };
    assert_eq!(buffer.record(&idle)?, Recorded::default());
    assert_eq!(buffer.record(&StepRows::<f64>::default())?, Recorded::default());
    Ok(())
}
