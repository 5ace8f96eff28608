//! A step of all environments at once equals a step of each.

use crate::common::{
    DIMS, Result, Telling, achieved_goal, action, begin, desired_goal, observation, reward, rows,
    step,
};
use her_relabel::{
    AddError, Batch, BufferConfig, GoalStrategy, HerBuffer, Sampler, StartBatch, StepBatch,
    UnitInterval,
};
use proptest::prelude::*;

const NUM_ENVS: usize = 3;

/// The rows of all environments, as a vectorized environment gives them.
#[derive(Default)]
struct Rows {
    observations: Vec<f64>,
    achieved_goals: Vec<f64>,
    desired_goals: Vec<f64>,
    actions: Vec<f64>,
    rewards: Vec<f64>,
}

impl Rows {
    /// State `t` of each `(episode, t)`, and the step that led there.
    fn new(states: &[(u32, u32)]) -> Self {
        let mut rows = Self::default();
        for &(episode, t) in states {
            rows.observations.extend(observation(episode, t));
            rows.achieved_goals.extend(achieved_goal(episode, t));
            rows.desired_goals.extend(desired_goal(episode));
            rows.actions.extend(action(episode, t.saturating_sub(1)));
            rows.rewards.push(reward(episode, t.saturating_sub(1)));
        }
        rows
    }

    fn starts(&self) -> StartBatch<'_, f64> {
        StartBatch {
            observations: &self.observations,
            achieved_goals: &self.achieved_goals,
            desired_goals: &self.desired_goals,
        }
    }

    fn steps<'a>(
        &'a self,
        ends: &'a ([bool; NUM_ENVS], [bool; NUM_ENVS]),
        next_starts: Option<StartBatch<'a, f64>>,
    ) -> StepBatch<'a, f64> {
        StepBatch {
            actions: &self.actions,
            rewards: &self.rewards,
            next_observations: &self.observations,
            next_achieved_goals: &self.achieved_goals,
            terminated: &ends.0,
            truncated: &ends.1,
            next_starts,
            fields: &[],
        }
    }
}

fn buffer() -> HerBuffer<f64> {
    HerBuffer::new(BufferConfig::new(40, DIMS).with_num_envs(NUM_ENVS)).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn steps_of_all_environments_are_steps_of_each(
        flags in prop::collection::vec(prop::array::uniform3(0_u8..12), 1..60),
    ) {
        let (mut together, mut each) = (buffer(), buffer());
        let mut states = [(0, 0), (1, 0), (2, 0)];
        let mut next_episode = 3;
        together.begin_episodes(&Rows::new(&states).starts()).unwrap();
        (0..NUM_ENVS).for_each(|env| begin(&mut each, env, env as u32).unwrap());
        for flags in flags {
            let ends = (flags.map(|flag| flag == 0), flags.map(|flag| flag < 2));
            let mut starts = states;
            for (env, state) in states.iter_mut().enumerate() {
                step(&mut each, env, state.0, state.1, (ends.0[env], ends.1[env])).unwrap();
                state.1 += 1;
                // The start of an environment that begins no episode is not read.
                starts[env] = (77, 77);
                if ends.1[env] {
                    starts[env] = (next_episode, 0);
                    begin(&mut each, env, next_episode).unwrap();
                    next_episode += 1;
                }
            }
            let (now, next) = (Rows::new(&states), Rows::new(&starts));
            together.add_steps(&now.steps(&ends, Some(next.starts()))).unwrap();
            for env in 0..NUM_ENVS {
                if ends.1[env] {
                    states[env] = starts[env];
                }
            }
        }
        let sampler = Sampler::new(200, GoalStrategy::Future, UnitInterval::from_k(1));
        let mut batches = [Batch::new(), Batch::new()];
        let drawn = [(&together, 0), (&each, 1)]
            .map(|(buffer, at)| sampler.sample(buffer, &Telling, 1, &mut batches[at]));
        prop_assert_eq!(&drawn[0], &drawn[1]);
        // The terminal observation belongs to the episode that ends, not to the next one.
        rows(&batches[0]);
        prop_assert_eq!(&batches[0], &batches[1]);
        for env in 0..NUM_ENVS {
            prop_assert_eq!(together.unfinished_steps(env), each.unfinished_steps(env));
        }
    }
}

#[test]
fn without_next_starts_an_ended_environment_waits_for_its_reset() -> Result {
    let mut buffer = buffer();
    let ends = ([false, true, false], [false; 3]);
    buffer.begin_episodes(&Rows::new(&[(0, 0), (1, 0), (2, 0)]).starts())?;
    buffer.add_steps(&Rows::new(&[(0, 1), (1, 1), (2, 1)]).steps(&ends, None))?;
    assert_eq!(buffer.len(), 1);
    let next = Rows::new(&[(0, 2), (1, 2), (2, 2)]);
    let error = buffer.add_steps(&next.steps(&ends, None)).unwrap_err();
    assert_eq!(error, AddError::NoEpisode { env: 1 });
    assert_eq!(buffer.unfinished_steps(0), Ok(Some(1)), "nothing was added");
    begin(&mut buffer, 1, 3)?;
    buffer.add_steps(&next.steps(&ends, None))?;
    Ok(())
}

#[test]
fn a_bad_row_of_one_environment_adds_nothing_for_any() -> Result {
    let mut buffer = buffer();
    let mut starts = Rows::new(&[(0, 0), (1, 0), (2, 0)]);
    starts.desired_goals[8] = f64::NAN;
    let error = buffer.begin_episodes(&starts.starts()).unwrap_err();
    assert!(matches!(error, AddError::NotFinite { field, .. } if field == "desired_goal"));
    assert_eq!(buffer.unfinished_steps(0), Ok(None));
    starts.desired_goals[8] = 0.5;
    let few = StartBatch { observations: &[0.0; 2], ..starts.starts() };
    let expected = AddError::WrongLength { field: "observations".into(), expected: 6, actual: 2 };
    assert_eq!(buffer.begin_episodes(&few), Err(expected));
    buffer.begin_episodes(&starts.starts())?;
    let again = buffer.begin_episodes(&starts.starts());
    assert_eq!(again, Err(AddError::EpisodeUnderWay { env: 0 }));

    let now = Rows::new(&[(0, 1), (1, 1), (2, 1)]);
    let ends = ([true, false, false], [false; 3]);
    let good = now.steps(&ends, None);
    let expected = AddError::WrongLength { field: "truncated".into(), expected: 3, actual: 1 };
    assert_eq!(buffer.add_steps(&StepBatch { truncated: &[true], ..good }), Err(expected));
    let mut bad = Rows::new(&[(0, 1), (1, 1), (2, 1)]);
    bad.achieved_goals[8] = f64::INFINITY;
    assert!(buffer.add_steps(&bad.steps(&ends, None)).is_err());
    // A start is read only where an episode ended.
    let mut next = Rows::new(&[(3, 0), (4, 0), (5, 0)]);
    next.observations[5] = f64::NAN;
    next.observations[0] = f64::NAN;
    assert!(buffer.add_steps(&now.steps(&ends, Some(next.starts()))).is_err());
    assert!(buffer.is_empty());
    next.observations[0] = 3.0;
    buffer.add_steps(&now.steps(&ends, Some(next.starts())))?;
    assert_eq!((buffer.len(), buffer.unfinished_steps(0)), (1, Ok(Some(0))));
    Ok(())
}
