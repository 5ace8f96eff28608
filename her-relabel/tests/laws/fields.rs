//! Additional fields that are refused.

use crate::common::{self, Result, Telling};
use her_relabel::{
    AddError, Batch, BufferConfig, ConfigError, GoalStrategy, HerBuffer, Sampler, StepData,
    StepRows, UnitInterval, UnknownField,
};

fn config(capacity: usize) -> BufferConfig {
    BufferConfig::new(capacity, common::DIMS).with_field("log_prob", 1).with_field("latent", 3)
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
