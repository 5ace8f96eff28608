//! Environments without goals, whose observations are arrays, with actions in double precision.

use fetch_env::{
    BoxSpace, Env, EnvError, Reset, Space, Step,
    spaces::SpaceError,
    vec_env::{AutoresetMode, VecConfig, VecEnv, VecEnvError, VecStep},
};

use crate::common::{MODES, Result};

/// The action that breaks a [`Counter`].
const BROKEN: f64 = -1.0;

/// Counts its steps in single precision, with a text as its info.
#[derive(Debug)]
struct Counter {
    steps: f32,
    observed: usize,
    actions: BoxSpace<f64>,
    observations: Space,
}

impl Counter {
    fn new(observed: usize) -> Self {
        Self {
            steps: 0.0,
            observed,
            actions: BoxSpace::unbounded(1).expect("small"),
            observations: BoxSpace::<f32>::unbounded(2).expect("small").into(),
        }
    }

    fn observe(&self) -> Vec<f32> {
        vec![self.steps; self.observed]
    }
}

impl Env for Counter {
    type Observation = Vec<f32>;
    type Info = String;
    type ActionSpace = BoxSpace<f64>;
    type ResetOptions = ();

    fn reset_with(
        &mut self,
        _seed: Option<u64>,
        (): &(),
    ) -> Result<Reset<Vec<f32>, String>, EnvError> {
        self.steps = 0.0;
        Ok(Reset { observation: self.observe(), info: "reset".into() })
    }

    fn step(&mut self, action: &[f64]) -> Result<Step<Vec<f32>, String>, EnvError> {
        if action[0] == BROKEN {
            return Err(EnvError::other("it is broken"));
        }
        self.steps += 1.0;
        Ok(Step {
            observation: self.observe(),
            reward: action[0],
            terminated: self.steps == 3.0,
            truncated: false,
            info: format!("step {}", self.steps),
        })
    }

    fn action_space(&self) -> &BoxSpace<f64> {
        &self.actions
    }

    fn observation_space(&self) -> &Space {
        &self.observations
    }
}

#[test]
fn plain_environments_are_stepped_together() -> Result {
    let config = VecConfig::default().with_autoreset(AutoresetMode::SameStep);
    let mut envs = VecEnv::new([Counter::new(2), Counter::new(2)], config)?;
    assert_eq!(envs.reset(None)?.array(), [0.0; 4]);
    envs.step(&[1.0, 2.0])?;
    let batch = envs.step(&[1.0, 2.0])?;
    assert_eq!((batch.array(), batch.next_array()), (&[2.0; 4][..], &[2.0; 4][..]));
    let batch = envs.step(&[0.1, 1e300])?;
    assert_eq!((batch.array(), batch.next_array()), (&[0.0; 4][..], &[3.0; 4][..]));
    assert_eq!((batch.reward(), batch.action()), (&[0.1, 1e300][..], &[0.1, 1e300][..]));
    assert_eq!(batch.info()[1].as_deref(), Some("reset"));
    assert_eq!(batch.final_info()[1].as_deref(), Some("step 3"));
    assert_eq!(batch.terminated(), [true, true]);
    Ok(())
}

#[test]
fn an_observation_that_does_not_fit_its_space_is_an_error() -> Result {
    let mut envs = VecEnv::new([Counter::new(2), Counter::new(3)], VecConfig::default())?;
    let expected = EnvError::ObservationLength { key: "observation", expected: 2, actual: 3 };
    assert_eq!(envs.reset(None)?.errors().collect::<Vec<_>>(), [(1, &expected)]);
    let batch = envs.step(&[0.0; 2])?;
    assert_eq!(batch.stepped(), [true, false]);

    let mut other = Counter::new(2);
    other.observations = BoxSpace::<f64>::unbounded(2)?.into();
    let error = VecEnv::new([other], VecConfig::default()).err();
    let expected =
        VecEnvError::Space(SpaceError::MissingPart { key: "observation", element: "f32" });
    assert_eq!(error, Some(expected));
    Ok(())
}

#[test]
fn an_episode_that_no_row_has_shown_is_not_stepped() -> Result {
    for mode in MODES {
        let config = VecConfig::default().with_autoreset(mode);
        let mut envs = VecEnv::new([Counter::new(2)], config)?;
        let observe = |envs: &mut VecEnv<Counter>, count| {
            envs.env_mut(0).expect("an idle environment").observed = count;
        };
        let failed = |batch: &VecStep<Vec<f32>, String, f64>| {
            matches!(batch.error(0), Some(EnvError::ObservationLength { .. }))
        };
        envs.reset(None)?;
        envs.step(&[0.0])?;
        for fails_in_reset in [true, false] {
            observe(&mut envs, 3);
            assert!(failed(if fails_in_reset { envs.reset(None)? } else { envs.step(&[0.0])? }));
            observe(&mut envs, 2);
            let batch = envs.step(&[0.0])?;
            let needs_reset = batch.error(0) == Some(&EnvError::ResetNeeded);
            assert_eq!(needs_reset, mode == AutoresetMode::Disabled);
            assert_eq!(batch.started(), [mode != AutoresetMode::Disabled]);
            envs.reset(None)?;
            assert_eq!(envs.step(&[0.0])?.array(), [1.0; 2]);
        }
    }
    Ok(())
}

#[test]
fn the_info_of_a_step_is_that_of_its_own_episode() -> Result {
    let config = VecConfig::default().with_autoreset(AutoresetMode::SameStep);
    let mut envs = VecEnv::new([Counter::new(2), Counter::new(2)], config)?;
    let batch = envs.reset(None)?;
    assert_eq!(
        [0, 1, 2].map(|row| batch.step_info(row).map(String::as_str)),
        [Some("reset"), Some("reset"), None]
    );
    let batch = envs.step(&[1.0, BROKEN])?;
    assert_eq!(batch.error(1), Some(&EnvError::other("it is broken")));
    assert_eq!(batch.info()[1].as_deref(), Some("reset"));
    assert_eq!((batch.step_info(0), batch.step_info(1)), (Some(&"step 1".into()), None));
    envs.step(&[1.0, 1.0])?;
    let batch = envs.step(&[1.0, 1.0])?;
    assert_eq!(batch.info()[0].as_deref(), Some("reset"));
    let infos = [0, 1].map(|row| batch.step_info(row).map(String::as_str));
    assert_eq!(infos, [Some("step 3"), Some("step 2")]);
    Ok(())
}

#[test]
fn a_vector_tells_what_it_is() -> Result {
    let config = VecConfig::default().with_autoreset(AutoresetMode::SameStep);
    let mut envs = VecEnv::new([Counter::new(2), Counter::new(2)], config)?;
    assert_eq!((envs.autoreset_mode(), envs.in_flight()), (AutoresetMode::SameStep, 0));
    envs.send_reset(None)?;
    assert_eq!(envs.in_flight(), 2);
    assert_eq!(
        format!("{envs:?}"),
        "VecEnv { num_envs: 2, in_flight: 2, autoreset: SameStep, .. }"
    );
    let batch = envs.recv(1)?;
    assert_eq!((batch.len(), batch.is_empty()), (1, false));
    assert_eq!(envs.in_flight(), 1);
    envs.recv(1)?;
    assert_eq!(envs.in_flight(), 0);
    let none = envs.recv(0)?;
    assert_eq!((none.len(), none.is_empty()), (0, true));
    Ok(())
}
