//! Rows of vectorized environments equal calls of one environment at a time.

use crate::common::{
    DIMS, Result, Telling, achieved_goal, action, begin, desired_goal, observation, reward, rows,
    step,
};
use her_relabel::{
    AddError, Batch, BufferConfig, GoalStrategy, HerBuffer, Recorded, Sampler, StepRows,
    UnitInterval,
};
use proptest::prelude::*;

const NUM_ENVS: usize = 4;

/// What a row holds.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    env: usize,
    /// The episode and the state before the step, and whether it is terminated and truncated.
    step: Option<(u32, u32)>,
    terminated: bool,
    truncated: bool,
    /// The episode that starts.
    start: Option<u32>,
    /// Whether the numbers of the step or of the start are not finite.
    bad_step: bool,
    bad_start: bool,
}

/// The columns of some rows. Whatever must not be read is NaN.
#[derive(Default)]
struct Columns {
    env_ids: Vec<usize>,
    stepped: Vec<bool>,
    started: Vec<bool>,
    actions: Vec<f32>,
    rewards: Vec<f64>,
    next_observations: Vec<f64>,
    next_achieved_goals: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    observations: Vec<f64>,
    achieved_goals: Vec<f64>,
    desired_goals: Vec<f64>,
}

impl Columns {
    fn new(rows: &[Row]) -> Self {
        let mut columns = Self::default();
        for row in rows {
            columns.env_ids.push(row.env);
            columns.stepped.push(row.step.is_some());
            columns.started.push(row.start.is_some());
            columns.terminated.push(row.terminated);
            columns.truncated.push(row.truncated);
            let (episode, t) = row.step.unwrap_or_default();
            let read = |value| if row.step.is_some() { value } else { f64::NAN };
            columns.actions.extend(action(episode, t).map(|value| read(value) as f32));
            columns.rewards.push(if row.bad_step { f64::NAN } else { read(reward(episode, t)) });
            columns.next_observations.extend(observation(episode, t + 1).map(read));
            columns.next_achieved_goals.extend(achieved_goal(episode, t + 1).map(read));
            let episode = row.start.unwrap_or_default();
            let read = |value| if row.start.is_some() { value } else { f64::NAN };
            columns.observations.extend(observation(episode, 0).map(read));
            columns.achieved_goals.extend(achieved_goal(episode, 0).map(read));
            let goal = desired_goal(episode);
            columns
                .desired_goals
                .extend(goal.map(|value| if row.bad_start { f64::INFINITY } else { read(value) }));
        }
        columns
    }

    fn rows(&self) -> StepRows<'_, f64, f64, f32> {
        StepRows {
            env_index: &self.env_ids,
            stepped: &self.stepped,
            started: &self.started,
            action: &self.actions,
            reward: &self.rewards,
            next_observation: &self.next_observations,
            next_achieved_goal: &self.next_achieved_goals,
            terminated: &self.terminated,
            truncated: &self.truncated,
            observation: &self.observations,
            achieved_goal: &self.achieved_goals,
            desired_goal: &self.desired_goals,
            fields: &[],
        }
    }
}

fn record(buffer: &mut HerBuffer<f64>, rows: &[Row]) -> Result<Recorded, AddError> {
    buffer.record(&Columns::new(rows).rows())
}

/// Records rows whose numbers can be stored.
fn record_all(buffer: &mut HerBuffer<f64>, rows: &[Row]) -> Result {
    Ok(record(buffer, rows)?.check()?)
}

fn buffer() -> HerBuffer<f64> {
    HerBuffer::new(BufferConfig::new(40, DIMS).with_num_envs(NUM_ENVS)).unwrap()
}

fn saved(buffer: &HerBuffer<f64>) -> Vec<u8> {
    let mut bytes = Vec::new();
    buffer.write_to(&mut bytes).unwrap();
    bytes
}

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

fn reset_row(env: usize, episode: u32) -> Row {
    Row { env, start: Some(episode), ..Row::default() }
}

fn step_row(env: usize, state: (u32, u32)) -> Row {
    Row { env, step: Some(state), ..Row::default() }
}

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
fn a_reset_in_the_middle_keeps_the_steps_before_it() -> Result {
    let mut buffer = buffer();
    record_all(&mut buffer, &[reset_row(3, 1)])?;
    record_all(&mut buffer, &[step_row(3, (1, 0))])?;
    let recorded = record(&mut buffer, &[reset_row(3, 2)])?;
    assert_eq!((recorded.finished_episodes, recorded.discarded_episodes), (1, 0));
    // An episode without steps leaves no trace.
    assert_eq!(record(&mut buffer, &[reset_row(3, 4)])?, Recorded::default());
    assert_eq!((buffer.len(), buffer.num_episodes()), (1, 1));
    let drawn =
        crate::common::draw(&buffer, &Sampler::new(1, GoalStrategy::Final, UnitInterval::ZERO), 0);
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
