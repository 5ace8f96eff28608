//! The rows of vectorized environments, in each of Gymnasium's modes of resetting.

use her_relabel::{GoalStrategy, Recorded, Sampler, UnitInterval};

use crate::common::{Result, draw};
use crate::step_rows::{Columns, Row, buffer, record, record_all, reset_row, saved, step_row};

#[derive(Clone, Copy, PartialEq)]
enum Mode {
    NextStep,
    SameStep,
    Disabled,
}

#[test]
fn every_mode_records_the_same_episodes() -> Result {
    let record_in = |mode| -> Result<Vec<u8>> {
        let mut buffer = buffer();
        record_all(&mut buffer, &[reset_row(0, 1)])?;
        for episode in 1..9 {
            for t in 0..2 {
                record_all(&mut buffer, &[step_row(0, (episode, t))])?;
            }
            let terminated = episode % 2 == 0;
            let last = Row { terminated, truncated: !terminated, ..step_row(0, (episode, 2)) };
            let start = reset_row(0, episode + 1).start;
            if mode == Mode::SameStep {
                record_all(&mut buffer, &[Row { start, ..last }])?;
                continue;
            }
            record_all(&mut buffer, &[last])?;
            if mode == Mode::Disabled {
                // Without autoreset the environment refuses its action until it is reset.
                record_all(&mut buffer, &[Row::default()])?;
            }
            record_all(&mut buffer, &[Row { start, ..Row::default() }])?;
        }
        assert_eq!((buffer.num_episodes(), buffer.len()), (8, 24));
        Ok(saved(&buffer))
    };
    let expected = record_in(Mode::NextStep)?;
    assert!(record_in(Mode::SameStep)? == expected);
    assert!(record_in(Mode::Disabled)? == expected);
    Ok(())
}

#[test]
fn a_reset_in_the_middle_keeps_the_steps_before_it() -> Result {
    let mut buffer = buffer();
    record_all(&mut buffer, &[reset_row(3, 1)])?;
    record_all(&mut buffer, &[step_row(3, (1, 0))])?;
    let recorded = record(&mut buffer, &[reset_row(3, 2)])?;
    assert_eq!((recorded.finished_episodes, recorded.discarded_episodes), (1, 0));
    // An episode without steps leaves no trace.
    assert_eq!(record(&mut buffer, &[reset_row(3, 4)])?, Recorded::default());
    assert_eq!((buffer.len(), buffer.num_episodes()), (1, 1));
    let drawn = draw(&buffer, &Sampler::new(1, GoalStrategy::Final, UnitInterval::ZERO), 0);
    assert_eq!(drawn[0].ends, (false, true));
    Ok(())
}

#[test]
fn a_clone_of_rows_has_the_same_rows() -> Result {
    let columns = Columns::new(&[reset_row(0, 1), reset_row(1, 2)]);
    let [mut one, mut other] = [buffer(), buffer()];
    one.record(&columns.rows())?.check()?;
    let clone = Some(&columns.rows()).cloned().ok_or("a clone")?;
    other.record(&clone)?.check()?;
    assert_eq!(saved(&one), saved(&other));
    assert_eq!(one.unfinished_steps(1)?, Some(0));
    Ok(())
}
