//! Rows of vectorized environments equal calls of one environment at a time.

use her_relabel::{AddError, Batch, GoalStrategy, HerBuffer, Recorded, Sampler, UnitInterval};
use proptest::prelude::*;

use crate::common::{Result, Telling, begin, draw, rows, step};
use crate::step_rows::{
    Columns, NUM_ENVS, Row, buffer, record, record_all, reset_row, saved, step_row,
};

/// Adds a row by the calls for one environment, and counts what [`HerBuffer::record`] counts.
fn add_apart(buffer: &mut HerBuffer<f64>, row: &Row, counts: &mut Recorded) {
    let env = row.env;
    let under_way = buffer.unfinished_steps(env).unwrap().is_some();
    match row.step {
        Some(_) if !under_way => counts.skipped_steps += 1,
        Some(_) if row.bad_step => {
            buffer.discard_episode(env).unwrap();
            counts.skipped_steps += 1;
            counts.discarded_episodes += 1;
        }
        Some((episode, t)) => {
            step(buffer, env, episode, t, (row.terminated, row.truncated)).unwrap();
            counts.recorded_steps += 1;
            counts.finished_episodes += usize::from(row.terminated || row.truncated);
        }
        None if row.truncated => {
            if !under_way {
                begin(buffer, env, 0).unwrap();
            }
            buffer.discard_episode(env).unwrap();
            counts.discarded_episodes += usize::from(under_way);
        }
        None => {}
    }
    if let Some(episode) = row.start {
        if let Some(steps) = buffer.unfinished_steps(env).unwrap() {
            buffer.end_episode(env).unwrap();
            counts.finished_episodes += usize::from(steps > 0);
        }
        begin(buffer, env, episode).unwrap();
        if row.bad_start {
            buffer.discard_episode(env).unwrap();
        }
    }
}

/// Checks that two buffers hold the same, and that the rows drawn from them are whole.
fn assert_same(together: &HerBuffer<f64>, apart: &HerBuffer<f64>) {
    assert_eq!(saved(together), saved(apart));
    let sampler = Sampler::new(200, GoalStrategy::Future, UnitInterval::from_k(1));
    let mut batch = Batch::<f64>::new();
    if sampler.sample(together, &Telling, 1, &mut batch).is_ok() {
        // The terminal observation belongs to the episode that ends, not to the next one.
        rows(&batch);
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Mode {
    NextStep,
    SameStep,
    Disabled,
}

/// Vectorized environments, whose episodes have numbers of their own.
#[derive(Default)]
struct Envs {
    /// The episode and the state of each environment.
    states: [(u32, u32); NUM_ENVS],
    /// Whether the episode is over, so that the next row must be a reset.
    over: [bool; NUM_ENVS],
    episodes: u32,
}

impl Envs {
    fn reset(&mut self, env: usize) -> Row {
        self.episodes += 1;
        self.states[env] = (self.episodes, 0);
        self.over[env] = false;
        Row { env, start: Some(self.episodes), ..Row::default() }
    }

    /// Returns the row that the environment gives, in the mode. `event` chooses what happens.
    fn row(&mut self, env: usize, mode: Mode, event: u8) -> Row {
        let state @ (episode, t) = self.states[env];
        if self.over[env] {
            return match (mode, event) {
                // Without autoreset the environment refuses its action until it is reset.
                (Mode::Disabled, 0..12) => Row { env, ..Row::default() },
                _ => self.reset(env),
            };
        }
        let step = Row { env, step: Some(state), ..Row::default() };
        let row = match event {
            // A failure, after which the environment is reset as after an end.
            0 => Row { env, truncated: true, ..Row::default() },
            1 | 2 => Row { terminated: true, truncated: event == 2, ..step },
            3 | 4 => Row { truncated: true, ..step },
            // A reset in the middle of the episode, or in the same row as its last step.
            5 => return self.reset(env),
            6 => {
                let start = self.reset(env).start;
                return Row { start, ..step };
            }
            7 => Row { bad_step: true, ..step },
            // A refused action.
            8 => return Row { env, ..Row::default() },
            _ => step,
        };
        self.states[env] = (episode, t + u32::from(row.step.is_some()));
        self.over[env] = row.terminated || row.truncated;
        if self.over[env] && mode == Mode::SameStep {
            let start = self.reset(env).start;
            return Row { start, bad_start: event == 4, ..row };
        }
        row
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn rows_of_any_mode_and_order_are_calls_of_one_environment_at_a_time(
        mode in prop::sample::select(vec![Mode::NextStep, Mode::SameStep, Mode::Disabled]),
        calls in prop::collection::vec(
            (
                Just((0..NUM_ENVS).collect::<Vec<_>>()).prop_shuffle(),
                0..=NUM_ENVS,
                prop::array::uniform4(0_u8..30),
            ),
            1..80,
        ),
    ) {
        let (mut together, mut apart) = (buffer(), buffer());
        let mut envs = Envs::default();
        let resets: Vec<Row> = (0..NUM_ENVS).map(|env| envs.reset(env)).collect();
        prop_assert_eq!(record(&mut together, &resets)?, Recorded::default());
        resets.iter().for_each(|row| add_apart(&mut apart, row, &mut Recorded::default()));
        for (order, count, events) in calls {
            let rows: Vec<Row> =
                order[..count].iter().map(|env| envs.row(*env, mode, events[*env])).collect();
            let mut expected = Recorded::default();
            rows.iter().for_each(|row| add_apart(&mut apart, row, &mut expected));
            let mut recorded = record(&mut together, &rows)?;
            let refusal = recorded.first_refusal.take();
            prop_assert!(refusal.is_none() || rows.iter().any(|row| row.bad_step || row.bad_start));
            prop_assert_eq!(recorded, expected);
            for env in 0..NUM_ENVS {
                prop_assert_eq!(together.unfinished_steps(env), apart.unfinished_steps(env));
            }
        }
        assert_same(&together, &apart);
    }

    #[test]
    fn any_rows_at_all_are_calls_of_one_environment_at_a_time(
        calls in prop::collection::vec(prop::array::uniform4(any::<[bool; 6]>()), 1..40),
    ) {
        let (mut together, mut apart) = (buffer(), buffer());
        let mut states = [(0, 0); NUM_ENVS];
        // Whether the last episode of each environment was discarded.
        let mut discarded = [false; NUM_ENVS];
        for (call, flags) in (1..).zip(calls) {
            let rows: Vec<Row> = flags.into_iter().enumerate().map(|(env, flags)| {
                let [stepped, terminated, truncated, started, bad_step, bad_start] = flags;
                let state = states[env];
                states[env].1 += u32::from(stepped);
                let episode = call * NUM_ENVS as u32 + env as u32;
                if started {
                    states[env] = (episode, 0);
                }
                Row {
                    env,
                    step: stepped.then_some(state),
                    terminated,
                    truncated,
                    start: started.then_some(episode),
                    bad_step,
                    bad_start,
                }
            }).collect();
            let is_unbegun = |row: &&Row| {
                let under_way = together.unfinished_steps(row.env).unwrap().is_some();
                row.step.is_some() && !under_way && !discarded[row.env]
            };
            if let Some(&Row { env: env_index, .. }) = rows.iter().find(is_unbegun) {
                let refused = record(&mut together, &rows);
                prop_assert_eq!(refused, Err(AddError::NoEpisode { env_index }));
                continue;
            }
            let mut expected = Recorded::default();
            for row in &rows {
                let env = row.env;
                let was_under_way = apart.unfinished_steps(env)?.is_some();
                add_apart(&mut apart, row, &mut expected);
                let is_lost = row.step.map_or(row.truncated, |_| was_under_way && row.bad_step);
                let is_kept = row.start.is_none() && (is_lost || discarded[env]);
                discarded[env] = is_kept || (row.start.is_some() && row.bad_start);
            }
            let mut recorded = record(&mut together, &rows)?;
            recorded.first_refusal = None;
            prop_assert_eq!(recorded, expected);
        }
        prop_assert_eq!(saved(&together), saved(&apart));
    }
}

#[test]
fn every_mode_records_the_same_episodes() -> Result {
    let record_in = |mode| -> Result<Vec<u8>> {
        let (mut buffer, mut envs) = (buffer(), Envs::default());
        record_all(&mut buffer, &[envs.reset(0)])?;
        while envs.episodes < 9 {
            // Episodes of three steps, terminated and truncated in turns. 20 resets, 9 goes on.
            let event = match (envs.over[0], envs.states[0].1) {
                (true, _) => 20,
                (false, 2) => 1 + 2 * (envs.states[0].0 % 2) as u8,
                (false, _) => 9,
            };
            record_all(&mut buffer, &[envs.row(0, mode, event)])?;
        }
        buffer.discard_episode(0)?;
        assert_eq!((buffer.num_episodes(), buffer.len()), (8, 24));
        Ok(saved(&buffer))
    };
    let expected = record_in(Mode::NextStep)?;
    assert_eq!(record_in(Mode::SameStep)?, expected);
    assert_eq!(record_in(Mode::Disabled)?, expected);
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
