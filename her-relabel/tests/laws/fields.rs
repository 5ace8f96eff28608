//! Additional fields stay with their transition, however they were added.

use crate::common::{
    self, Result, Telling, achieved_goal, action, desired_goal, observation, reward, rows,
};
use goal_reward::GoalReward;
use her_relabel::{
    AddError, Batch, BufferConfig, ConfigError, EpisodeData, GoalStrategy, HerBuffer, NStep,
    Sampler, StepData, StepRows, UnitInterval, UnknownField,
};
use std::num::NonZeroUsize;

fn config(capacity: usize) -> BufferConfig {
    BufferConfig::new(capacity, common::DIMS).with_field("log_prob", 1).with_field("latent", 3)
}

fn log_prob(episode: u32, t: u32) -> [f64; 1] {
    [-f64::from(episode) - f64::from(t) / 64.0]
}

fn latent(episode: u32, t: u32) -> [f64; 3] {
    [f64::from(t), 0.75, f64::from(episode)]
}

fn add_whole(buffer: &mut HerBuffer<f64>, episode: u32, len: u32) {
    let flat = |part: &dyn Fn(u32) -> Vec<f64>, count| (0..count).flat_map(part).collect();
    let observations: Vec<f64> = flat(&|t| observation(episode, t).to_vec(), len + 1);
    let achieved_goals: Vec<f64> = flat(&|t| achieved_goal(episode, t).to_vec(), len + 1);
    let actions: Vec<f64> = flat(&|t| action(episode, t).to_vec(), len);
    let rewards: Vec<f64> = flat(&|t| vec![reward(episode, t)], len);
    let log_probs: Vec<f64> = flat(&|t| log_prob(episode, t).to_vec(), len);
    let latents: Vec<f64> = flat(&|t| latent(episode, t).to_vec(), len);
    let data = EpisodeData {
        observation: &observations,
        achieved_goal: &achieved_goals,
        desired_goal: &desired_goal(episode),
        action: &actions,
        reward: &rewards,
        terminated: false,
        truncated: true,
        fields: &[("latent", &latents), ("log_prob", &log_probs)],
    };
    buffer.add_episode(&data).unwrap();
}

/// Adds an episode to every environment, one step of all at a time.
fn add_vectorized(buffer: &mut HerBuffer<f64>, episodes: &[u32], len: u32) {
    let flat = |part: &dyn Fn(u32) -> Vec<f64>| -> Vec<f64> {
        episodes.iter().flat_map(|episode| part(*episode)).collect()
    };
    let envs: Vec<usize> = (0..episodes.len()).collect();
    let [no, yes] = [false, true].map(|flag| vec![flag; episodes.len()]);
    let starts: StepRows<'_, f64> = StepRows {
        env_index: &envs,
        stepped: &no,
        started: &yes,
        truncated: &no,
        observation: &flat(&|episode| observation(episode, 0).to_vec()),
        achieved_goal: &flat(&|episode| achieved_goal(episode, 0).to_vec()),
        desired_goal: &flat(&|episode| desired_goal(episode).to_vec()),
        ..StepRows::default()
    };
    buffer.record(&starts).unwrap().check().unwrap();
    for t in 0..len {
        let log_probs = flat(&|episode| log_prob(episode, t).to_vec());
        let latents = flat(&|episode| latent(episode, t).to_vec());
        let steps = StepRows {
            env_index: &envs,
            stepped: &yes,
            started: &no,
            action: &flat(&|episode| action(episode, t).to_vec()),
            reward: &flat(&|episode| vec![reward(episode, t)]),
            next_observation: &flat(&|episode| observation(episode, t + 1).to_vec()),
            next_achieved_goal: &flat(&|episode| achieved_goal(episode, t + 1).to_vec()),
            terminated: &no,
            truncated: &vec![t + 1 == len; episodes.len()],
            fields: &[("log_prob", &log_probs), ("latent", &latents)],
            ..StepRows::default()
        };
        let recorded = buffer.record(&steps).unwrap();
        assert_eq!(recorded.recorded_steps, episodes.len());
    }
}

fn add_steps(buffer: &mut HerBuffer<f64>, episode: u32, len: u32) {
    common::begin(buffer, 0, episode).unwrap();
    for t in 0..len {
        let step = StepData {
            action: &action(episode, t),
            reward: reward(episode, t),
            next_observation: &observation(episode, t + 1),
            next_achieved_goal: &achieved_goal(episode, t + 1),
            terminated: false,
            truncated: t + 1 == len,
            fields: &[("log_prob", &log_prob(episode, t)), ("latent", &latent(episode, t))],
        };
        buffer.add_step(0, &step).unwrap();
    }
}

/// Checks the fields of all rows by the place that the observation identifies.
fn assert_fields(batch: &Batch<f64>) {
    let seen = batch.observation().chunks_exact(2);
    let log_probs = batch.field("log_prob").unwrap().chunks_exact(1);
    let latents = batch.field("latent").unwrap().chunks_exact(3);
    assert_eq!((log_probs.len(), latents.len()), (batch.len(), batch.len()));
    for ((seen, log_probs), latents) in seen.zip(log_probs).zip(latents) {
        let (episode, t) = (seen[0] as u32, seen[1] as u32);
        assert_eq!(log_probs, log_prob(episode, t));
        assert_eq!(latents, latent(episode, t));
    }
}

#[test]
fn fields_stay_with_their_transition_however_they_were_added() -> Result {
    let mut buffer = HerBuffer::<f64>::new(config(200).with_num_envs(2))?;
    let mut batch = Batch::<f64>::new();
    let sampler = Sampler::new(600, GoalStrategy::Future, UnitInterval::from_k(4));
    let n_step = NStep::new(NonZeroUsize::MIN.saturating_add(2), UnitInterval::new(0.9)?);
    for round in 0..12 {
        add_whole(&mut buffer, 4 * round, 1 + round * 5 % 17);
        add_vectorized(&mut buffer, &[4 * round + 1, 4 * round + 2], 1 + round * 7 % 13);
        add_steps(&mut buffer, 4 * round + 3, 1 + round * 3 % 11);
        sampler.sample(&buffer, &Telling, u64::from(round), &mut batch)?;
        rows(&batch);
        assert_fields(&batch);
        let windows = sampler.with_n_step(n_step).with_parallel(true);
        windows.sample(&buffer, &Telling, u64::from(round), &mut batch)?;
        assert_fields(&batch);
    }
    assert_eq!(buffer.len(), 200, "the ring has wrapped");
    Ok(())
}

#[test]
fn a_loaded_buffer_has_the_fields_of_the_saved_one() -> Result {
    let mut buffer = HerBuffer::<f64>::new(config(30))?;
    for episode in 0..7 {
        add_whole(&mut buffer, episode, 9);
    }
    let mut bytes = Vec::new();
    buffer.write_to(&mut bytes)?;
    let loaded = HerBuffer::<f64>::read_from(&bytes[..])?;
    let sampler = Sampler::new(200, GoalStrategy::Future, UnitInterval::from_k(4));
    let (mut batch, mut expected) = (Batch::<f64>::new(), Batch::<f64>::new());
    sampler.sample(&loaded, &Telling, 0, &mut batch)?;
    sampler.sample(&buffer, &Telling, 0, &mut expected)?;
    assert_fields(&batch);
    assert_eq!(batch, expected);
    Ok(())
}

#[test]
fn an_episode_longer_than_the_buffer_keeps_the_fields_of_its_end() -> Result {
    let mut buffer = HerBuffer::<f64>::new(config(7))?;
    let sampler = Sampler::new(100, GoalStrategy::Final, UnitInterval::ONE);
    let mut batch = Batch::<f64>::new();
    for add in [add_whole, add_steps] {
        add(&mut buffer, 1, 20);
        sampler.sample(&buffer, &Telling, 0, &mut batch)?;
        assert_fields(&batch);
    }
    Ok(())
}

#[test]
fn a_field_shorter_than_the_goal_shares_the_place_of_the_goal() -> Result {
    // Two elements follow the state, and the desired goal has three.
    let narrow = BufferConfig::new(50, common::DIMS);
    let mut plain = HerBuffer::<f64>::new(narrow.clone())?;
    let mut buffer = HerBuffer::<f64>::new(narrow.with_field("value", 1))?;
    let sampler = Sampler::new(100, GoalStrategy::PastDesired, UnitInterval::from_k(1));
    let (mut batch, mut without) = (Batch::<f64>::new(), Batch::<f64>::new());
    common::add(&mut plain, 1, 1, (false, true));
    let data = EpisodeData {
        observation: &[observation(1, 0), observation(1, 1)].concat(),
        achieved_goal: &[achieved_goal(1, 0), achieved_goal(1, 1)].concat(),
        desired_goal: &desired_goal(1),
        action: &action(1, 0),
        reward: &[reward(1, 0)],
        terminated: false,
        truncated: true,
        fields: &[("value", &[3.5])],
    };
    buffer.add_episode(&data)?;
    sampler.sample(&buffer, &Telling, 0, &mut batch)?;
    sampler.sample(&plain, &Telling, 0, &mut without)?;
    assert_eq!(batch.field("value")?, [3.5; 100]);
    assert_eq!(batch.desired_goal(), without.desired_goal());
    assert_eq!(batch.reward(), without.reward());
    Ok(())
}

#[test]
fn each_of_three_fields_is_a_column() -> Result {
    let config = config(50).with_field("value", 1);
    let mut buffer = HerBuffer::<f64>::new(config)?;
    let steps = 5;
    let numbers = |count: u32, first: u32| -> Vec<f64> {
        (0..count * steps).map(|at| f64::from(first + at)).collect()
    };
    let data = EpisodeData {
        observation: &[0.0; 12],
        achieved_goal: &[0.0; 18],
        desired_goal: &[0.0; 3],
        action: &[0.0; 5],
        reward: &[0.0; 5],
        terminated: false,
        truncated: true,
        fields: &[
            ("value", &numbers(1, 300)),
            ("log_prob", &numbers(1, 100)),
            ("latent", &numbers(3, 200)),
        ],
    };
    buffer.add_episode(&data)?;
    let sampler = Sampler::new(100, GoalStrategy::Future, UnitInterval::ZERO);
    let mut batch = Batch::<f64>::new();
    sampler.sample(&buffer, &Telling, 0, &mut batch)?;
    let first = buffer.transition_ids().ok_or("empty")?.0.get();
    for (row, id) in batch.transition().iter().enumerate() {
        let step = (id.get() - first) as f64;
        let latent = [0.0, 1.0, 2.0].map(|at| 200.0 + 3.0 * step + at);
        assert_eq!(batch.field("value")?[row], 300.0 + step);
        assert_eq!(batch.field("log_prob")?[row], 100.0 + step);
        assert_eq!(batch.field("latent")?[3 * row..][..3], latent);
    }
    Ok(())
}

#[test]
fn a_bad_number_in_a_field_refuses_its_own_row_alone() -> Result {
    for bad in 0..3 {
        let mut buffer = HerBuffer::<f64>::new(config(50).with_num_envs(3))?;
        (0..3).try_for_each(|env| common::begin(&mut buffer, env, env as u32))?;
        let mut latents = [0.5; 9];
        latents[3 * bad + 1] = f64::NAN;
        let rows: StepRows<'_, f64> = StepRows {
            env_index: &[0, 1, 2],
            stepped: &[true; 3],
            started: &[false; 3],
            action: &[0.0; 3],
            reward: &[0.0; 3],
            next_observation: &[0.0; 6],
            next_achieved_goal: &[0.0; 9],
            terminated: &[false; 3],
            truncated: &[false; 3],
            fields: &[("log_prob", &[0.0; 3]), ("latent", &latents)],
            ..StepRows::default()
        };
        let recorded = buffer.record(&rows)?;
        assert_eq!((recorded.recorded_steps, recorded.discarded_episodes), (2, 1));
        for env in 0..3 {
            assert_eq!(buffer.unfinished_steps(env)?, (env != bad).then_some(1), "{env} of {bad}");
        }
    }
    Ok(())
}

#[test]
fn unknown_missing_repeated_and_misshapen_fields_are_refused() -> Result {
    let mut buffer = HerBuffer::<f64>::new(config(50))?;
    common::begin(&mut buffer, 0, 1)?;
    let good = StepData {
        action: &[0.0],
        reward: 0.0,
        next_observation: &[0.0; 2],
        next_achieved_goal: &[0.0; 3],
        terminated: false,
        truncated: true,
        fields: &[("log_prob", &[0.0]), ("latent", &[0.0; 3])],
    };
    let refusal = |fields: &[(&str, &[f64])], buffer: &mut HerBuffer<f64>| {
        let error = buffer.add_step(0, &StepData { fields, ..good }).unwrap_err();
        assert_eq!(buffer.unfinished_steps(0), Ok(Some(0)));
        error
    };
    let unknown = refusal(&[("log_prob", &[0.0]), ("value", &[0.0])], &mut buffer);
    assert_eq!(
        unknown.to_string(),
        "there is no field `value` among [log_prob, latent]: declare it with \
         `BufferConfig::with_field`"
    );
    let missing = refusal(&[("log_prob", &[0.0])], &mut buffer);
    assert_eq!(missing, AddError::MissingField { name: "latent".into() });
    let repeated = refusal(&[("log_prob", &[0.0]), ("log_prob", &[0.0])], &mut buffer);
    assert_eq!(repeated, AddError::RepeatedField { name: "log_prob".into() });
    let short = refusal(&[("log_prob", &[0.0]), ("latent", &[0.0])], &mut buffer);
    assert_eq!(short, AddError::WrongLength { field: "latent".into(), expected: 3, actual: 1 });
    let nan = refusal(&[("log_prob", &[f64::NAN]), ("latent", &[0.0; 3])], &mut buffer);
    assert!(matches!(nan, AddError::NotFinite { field, index: 0, .. } if field == "log_prob"));
    buffer.add_step(0, &good)?;

    let mut batch = Batch::<f64>::new();
    assert!(matches!(batch.field("log_prob"), Err(UnknownField { known, .. }) if known.is_empty()));
    let sampler = Sampler::new(3, GoalStrategy::Final, UnitInterval::ZERO);
    sampler.sample(&buffer, &Telling, 0, &mut batch)?;
    assert_eq!(batch.field("latent")?, [0.0; 9]);
    assert!(matches!(batch.field("value"), Err(UnknownField { name, .. }) if name == "value"));
    Ok(())
}

#[test]
fn fields_need_proper_names_and_lengths() {
    let refused = |config: BufferConfig| HerBuffer::<f32>::new(config).unwrap_err();
    let plain = BufferConfig::new(9, common::DIMS);
    for name in ["", "a b", "naïve", "a/b", &"x".repeat(65)] {
        let error = refused(plain.clone().with_field(name, 1));
        assert_eq!(error, ConfigError::FieldName { name: name.to_owned() });
    }
    assert!(matches!(refused(config(9).with_field("latent", 2)), ConfigError::FieldName { .. }));
    let zero = ConfigError::Zero { name: "fields.len" };
    assert_eq!(refused(plain.clone().with_field("none", 0)), zero);
    let huge = plain.with_field("a", usize::MAX).with_field("b", usize::MAX);
    assert_eq!(refused(huge), ConfigError::TooLarge);
}

#[test]
fn the_reward_does_not_depend_on_fields() -> Result {
    let mut buffer = HerBuffer::<f64>::new(config(50))?;
    add_whole(&mut buffer, 2, 9);
    let mut batch = Batch::<f64>::new();
    let sampler = Sampler::new(64, GoalStrategy::Episode, UnitInterval::ONE);
    sampler.sample(&buffer, &Telling, 0, &mut batch)?;
    for row in 0..batch.len() {
        let goals = (&batch.next_achieved_goal()[3 * row..], &batch.desired_goal()[3 * row..]);
        assert_eq!(batch.reward()[row], Telling.reward(goals.0, goals.1));
    }
    Ok(())
}
