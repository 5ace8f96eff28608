//! An environment whose actions and observations are choices.

use fetch_env::{
    ActionSpace, DiscreteSpace, Env, EnvError, EnvExt, MultiBinarySpace, NpRandom, Reset, Space,
    Step, TimeLimit, VecEnv,
    check::{CheckOptions, check_env},
    vec_env::VecConfig,
    wrappers::RecordEpisodeStatistics,
};

use crate::Result;

/// A switchboard: an action turns one of forty switches, and the observation is their positions.
struct Switches {
    random: NpRandom,
    observation: Option<[bool; 40]>,
    action_space: DiscreteSpace,
    observation_space: Space,
}

impl Switches {
    fn new() -> Result<Self, EnvError> {
        Ok(Self {
            random: NpRandom::from_entropy()?,
            observation: None,
            action_space: DiscreteSpace::from_start(40, 1)?,
            observation_space: MultiBinarySpace::new(vec![40]).expect("small").into(),
        })
    }
}

impl Env for Switches {
    type Observation = [bool; 40];
    type Info = ();
    type ActionSpace = DiscreteSpace;
    type ResetOptions = ();

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        (): &(),
    ) -> Result<Reset<[bool; 40], ()>, EnvError> {
        if let Some(seed) = seed {
            self.random = NpRandom::new(seed);
        }
        let mut observation = [false; 40];
        MultiBinarySpace::new(vec![40])?.sample_action(&mut self.random, &mut observation)?;
        self.observation = Some(observation);
        Ok(Reset { observation, info: () })
    }

    fn step(&mut self, action: &[i64]) -> Result<Step<[bool; 40], ()>, EnvError> {
        let observation = self.observation.as_mut().ok_or(EnvError::ResetNeeded)?;
        self.action_space.check_action(action)?;
        let index = (action[0] - self.action_space.start()) as usize;
        observation[index] ^= true;
        let on = observation.iter().filter(|&&on| on).count();
        let observation = *observation;
        let terminated = on == 0;
        if terminated {
            self.observation = None;
        }
        Ok(Step { observation, reward: -(on as f64), terminated, truncated: false, info: () })
    }

    fn action_space(&self) -> &DiscreteSpace {
        &self.action_space
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}

#[test]
fn an_environment_of_choices_keeps_every_law_and_fills_rows() -> Result {
    let report = check_env(Switches::new, &CheckOptions::default().with_max_episode_steps(None));
    assert!(report.passed(), "{report}");

    let limit = std::num::NonZeroU32::new(9);
    let limited = || {
        Switches::new()?
            .wrap(TimeLimit::new(limit.expect("not zero")))?
            .wrap(RecordEpisodeStatistics::new())
    };
    let report = check_env(limited, &CheckOptions::default().with_max_episode_steps(limit));
    assert!(report.passed(), "{report}");

    let envs = [Switches::new()?, Switches::new()?];
    let mut envs = VecEnv::new(envs, VecConfig::default())?;
    let before = envs.reset(Some(5))?.array().to_vec();
    let batch = envs.step(&[1, 40])?;
    assert_eq!(batch.action(), [1, 40]);
    let turned = batch.array().iter().zip(&before).enumerate().filter(|(_, (a, b))| a != b);
    assert_eq!(turned.map(|(index, _)| index).collect::<Vec<_>>(), [0, 40 + 39]);
    let refusal = EnvError::ActionOutside { index: 0, value: 41, first: 1, last: 40 };
    assert_eq!(envs.step(&[41, 1])?.error(0), Some(&refusal));
    Ok(())
}
