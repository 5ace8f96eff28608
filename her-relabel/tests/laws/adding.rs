//! Rejected additions, which change nothing.

use crate::common::{
    DIMS, Result, Telling, achieved_goal, add, begin, buffer, desired_goal, observation, step,
};
use her_relabel::{
    AddError, Batch, BufferConfig, ConfigError, Dims, EpisodeData, GoalStrategy, HerBuffer,
    Sampler, StartData, StepData, UnitInterval,
};

#[test]
fn sizes_of_zero_and_sizes_beyond_memory_are_refused() {
    let zero = |config| match HerBuffer::<f32>::new(config) {
        Err(ConfigError::Zero { name }) => name,
        other => panic!("{other:?}"),
    };
    assert_eq!(zero(BufferConfig::new(0, DIMS)), "capacity");
    assert_eq!(zero(BufferConfig::new(1, DIMS).with_num_envs(0)), "num_envs");
    assert_eq!(zero(BufferConfig::new(1, Dims { observation: 0, ..DIMS })), "dims.observation");
    assert_eq!(zero(BufferConfig::new(1, Dims { goal: 0, ..DIMS })), "dims.goal");
    assert_eq!(zero(BufferConfig::new(1, Dims { action: 0, ..DIMS })), "dims.action");
    for config in [
        BufferConfig::new(usize::MAX, DIMS),
        BufferConfig::new(1, Dims { observation: usize::MAX, ..DIMS }),
    ] {
        assert_eq!(HerBuffer::<f32>::new(config).unwrap_err(), ConfigError::TooLarge);
    }
}

#[test]
fn a_large_capacity_costs_nothing_until_it_is_used() {
    let mut buffer = buffer(1 << 50);
    add(&mut buffer, 1, 3, (false, true));
    assert_eq!(buffer.len(), 3);
}

#[test]
fn calls_out_of_order_are_errors() -> Result {
    let mut buffer = buffer(10);
    assert_eq!(
        step(&mut buffer, 0, 1, 0, (false, false)),
        Err(AddError::NoEpisode { env_index: 0 })
    );
    assert_eq!(buffer.end_episode(0), Err(AddError::NoEpisode { env_index: 0 }));
    assert_eq!(buffer.discard_episode(0), Err(AddError::NoEpisode { env_index: 0 }));
    let unknown = AddError::UnknownEnv { env_index: 1, num_envs: 1 };
    assert_eq!(begin(&mut buffer, 1, 1), Err(unknown.clone()));
    assert_eq!(step(&mut buffer, 1, 1, 0, (false, false)), Err(unknown.clone()));
    assert_eq!(buffer.unfinished_steps(1), Err(unknown));
    begin(&mut buffer, 0, 1)?;
    assert_eq!(begin(&mut buffer, 0, 2), Err(AddError::EpisodeUnderWay { env_index: 0 }));
    step(&mut buffer, 0, 1, 0, (false, true))?;
    assert_eq!(
        step(&mut buffer, 0, 1, 1, (false, true)),
        Err(AddError::NoEpisode { env_index: 0 }),
        "no step after the end"
    );
    assert_eq!(buffer.len(), 1);
    Ok(())
}

#[test]
fn an_episode_without_a_step_leaves_no_trace() -> Result {
    let mut buffer = buffer(10);
    begin(&mut buffer, 0, 1)?;
    buffer.end_episode(0)?;
    assert!(buffer.is_empty());
    begin(&mut buffer, 0, 2)?;
    Ok(())
}

#[test]
fn a_bad_step_is_refused_whole() -> Result {
    let mut buffer = buffer(10);
    begin(&mut buffer, 0, 1)?;
    let good = StepData {
        action: &[0.0],
        reward: 0.0,
        next_observation: &[0.0, 0.0],
        next_achieved_goal: &[0.0; 3],
        terminated: true,
        truncated: false,
        fields: &[],
    };
    let not_finite = |error| match error {
        Err(AddError::NotFinite { field, index, .. }) => format!("{field}[{index}]"),
        other => panic!("{other:?}"),
    };
    let too_short = StepData { action: &[], ..good };
    assert_eq!(
        buffer.add_step(0, &too_short),
        Err(AddError::WrongLength { field: "action".into(), expected: 1, actual: 0 })
    );
    let bad = StepData { reward: f64::NAN, ..good };
    assert_eq!(not_finite(buffer.add_step(0, &bad)), "reward[0]");
    let bad = StepData { next_observation: &[0.0, f64::INFINITY], ..good };
    assert_eq!(not_finite(buffer.add_step(0, &bad)), "next_observation[1]");
    let bad = StepData { next_achieved_goal: &[0.0, 0.0, f64::NAN], ..good };
    assert_eq!(not_finite(buffer.add_step(0, &bad)), "next_achieved_goal[2]");
    assert_eq!(buffer.unfinished_steps(0), Ok(Some(0)));
    assert!(buffer.is_empty());
    buffer.add_step(0, &good)?;
    assert_eq!(buffer.len(), 1);
    Ok(())
}

#[test]
fn a_bad_start_begins_nothing() {
    let mut buffer = buffer(10);
    let start =
        StartData { observation: &[0.0, 0.0], achieved_goal: &[0.0; 3], desired_goal: &[0.0; 2] };
    assert_eq!(
        buffer.begin_episode(0, &start),
        Err(AddError::WrongLength { field: "desired_goal".into(), expected: 3, actual: 2 })
    );
    assert_eq!(buffer.unfinished_steps(0), Ok(None));
}

#[test]
fn a_bad_whole_episode_is_refused() -> Result {
    let mut buffer = buffer(10);
    let good = EpisodeData {
        observation: &[0.0; 4],
        achieved_goal: &[0.0; 6],
        desired_goal: &[0.0; 3],
        action: &[0.0],
        reward: &[0.0],
        terminated: true,
        truncated: false,
        fields: &[],
    };
    let empty = EpisodeData { reward: &[], ..good };
    assert_eq!(buffer.add_episode(&empty), Err(AddError::EmptyEpisode));
    let endless = EpisodeData { terminated: false, ..good };
    assert_eq!(buffer.add_episode(&endless), Err(AddError::NotEnded));
    let short = EpisodeData { observation: &[0.0; 2], ..good };
    assert_eq!(
        buffer.add_episode(&short),
        Err(AddError::WrongLength { field: "observation".into(), expected: 4, actual: 2 })
    );
    // One bad number does not make up for another.
    for bad in [&[f64::NAN, 0.0, 0.0, 0.0], &[f64::NAN, f64::NAN, 0.0, 0.0]] {
        let error = buffer.add_episode(&EpisodeData { observation: bad, ..good }).err();
        assert!(matches!(error, Some(AddError::NotFinite { index: 0, .. })), "{bad:?}");
    }
    assert!(buffer.is_empty());
    buffer.add_episode(&good)?;
    Ok(())
}

#[test]
fn a_number_that_f32_cannot_hold_is_refused_and_named() -> Result {
    let dims = Dims { observation: 1, goal: 1, action: 1 };
    let mut buffer = HerBuffer::<f32>::new(BufferConfig::new(10, dims))?;
    let start = StartData { observation: &[1e300], achieved_goal: &[0.0], desired_goal: &[0.0] };
    let error = buffer.begin_episode(0, &start).unwrap_err();
    assert_eq!(error, AddError::NotFinite { field: "observation".into(), index: 0, value: 1e300 });
    assert!(error.to_string().contains("`observation[0]` is 1e300, "));
    Ok(())
}

#[test]
fn actions_may_be_of_another_type_than_observations() -> Result {
    let add_by_step = |buffer: &mut HerBuffer<f64>| -> Result {
        begin(buffer, 0, 1)?;
        buffer.add_step(
            0,
            &StepData {
                action: &[0.1_f32],
                reward: 0.1_f64,
                next_observation: &[0.1, 0.2],
                next_achieved_goal: &[0.1; 3],
                terminated: true,
                truncated: false,
                fields: &[],
            },
        )?;
        Ok(())
    };
    let (mut by_step, mut whole) = (buffer(10), buffer(10));
    add_by_step(&mut by_step)?;
    whole.add_episode(&EpisodeData {
        observation: &[observation(1, 0), [0.1, 0.2]].concat(),
        achieved_goal: &[achieved_goal(1, 0), [0.1; 3]].concat(),
        desired_goal: &desired_goal(1),
        action: &[0.1_f32],
        reward: &[0.1],
        terminated: true,
        truncated: false,
        fields: &[],
    })?;
    for buffer in [by_step, whole] {
        let sampler = Sampler::new(1, GoalStrategy::Final, UnitInterval::ZERO);
        let mut batch = Batch::<f64>::new();
        sampler.sample(&buffer, &Telling, 0, &mut batch)?;
        assert_eq!((batch.action(), batch.reward()), (&[f64::from(0.1_f32)][..], &[0.1][..]));
        assert_eq!(batch.next_observation(), [0.1, 0.2]);
    }
    Ok(())
}
