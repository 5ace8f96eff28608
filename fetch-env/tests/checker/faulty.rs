//! An environment that breaks one law, or none.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use fetch_env::{
    BoxSpace, DictSpace, Env, EnvError, FetchResetOptions, GoalEnv, GoalObservation, Info,
    KinematicEnv, Reset, SnapshotEnv, Space, Step, make_kinematic,
};

use crate::parts::{FaultyActions, FaultyReward, NotedInfo, Observation};

/// Fault of an environment, or a peculiarity that is not a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fault {
    None,
    NeverSucceeds,
    TerminatesAtOnce,
    TruncatesAtOnce,
    WideActionSpace,
    LopsidedActionSpace,
    ClosedActionSpace,
    EmptyActionSpace,
    RefusesItsSamples,
    MissingKey,
    GoalsOfTwoShapes,
    GoalsInSinglePrecision,
    GoalsOfOneValue,
    StepsBeforeReset,
    TakesNan,
    TakesAnyLength,
    BadActionsMove,
    ShortObservation,
    IgnoresTheSeed,
    RestartsTheStream,
    KnowsOneSeed,
    UnseededIsZero,
    DefaultsMatter,
    NanReward,
    RemembersEpisodes,
    MovesTheGoal,
    RewardOffByABit,
    BatchOffByABit,
    OnlyMissesSucceed,
    TakesBadGoals,
    LiesAboutSuccess,
    LiesAboutDistance,
    VariesTheInfo,
    FlipsASignInTheInfo,
    Terminates,
    TruncatesEarly,
    TruncatesLate,
    StepsAfterTheEnd,
    RestoresNothing,
    ForgetsTheEpisodes,
    RestoresANewEnvironmentAsRunning,
    HidesState,
}

/// A Push task without physics, with a fault.
pub(crate) struct Faulty {
    env: KinematicEnv,
    fault: Fault,
    reward: FaultyReward,
    action_space: FaultyActions,
    observation_space: Space,
    last_seed: u64,
    episodes: u32,
    elapsed: u32,
    /// Whether the gripper has been far to the left in this episode, which no snapshot holds.
    was_left: bool,
}

impl Faulty {
    pub(crate) fn new(fault: Fault) -> Result<Self, EnvError> {
        let env = make_kinematic("FetchPushDense-v4")?;
        let (low, high) = match fault {
            Fault::WideActionSpace => (-2.0, 2.0),
            Fault::LopsidedActionSpace => (0.0, 1.0),
            Fault::ClosedActionSpace => (0.0, 0.0),
            _ => (-1.0, 1.0),
        };
        let len = if fault == Fault::EmptyActionSpace { 0 } else { 4 };
        let space = BoxSpace::uniform(vec![len], low, high).expect("low is at most high");
        let observation_space = match fault {
            Fault::MissingKey => dict(&[("achieved_goal", 3), ("observation", 25)]),
            Fault::GoalsOfTwoShapes => {
                dict(&[("achieved_goal", 3), ("desired_goal", 2), ("observation", 25)])
            }
            Fault::GoalsInSinglePrecision => {
                with_goals(BoxSpace::<f32>::unbounded(3).expect("small").into())
            }
            Fault::GoalsOfOneValue => {
                with_goals(BoxSpace::uniform(vec![3], 0.5, 0.5).expect("one value").into())
            }
            _ => env.observation_space().clone(),
        };
        Ok(Self {
            reward: FaultyReward { reward: *env.goal_reward(), fault },
            env,
            fault,
            action_space: FaultyActions { space, fault },
            observation_space,
            last_seed: 0,
            episodes: 0,
            elapsed: 0,
            was_left: false,
        })
    }

    fn is(&self, fault: Fault) -> bool {
        self.fault == fault
    }

    fn noted(&self, info: Info) -> NotedInfo {
        static CALLS: AtomicU32 = AtomicU32::new(0);
        let call = CALLS.fetch_add(1, Relaxed);
        let note = match self.fault {
            Fault::VariesTheInfo => call.into(),
            Fault::FlipsASignInTheInfo if call.is_multiple_of(3) => -0.0,
            Fault::FlipsASignInTheInfo => 0.0,
            // Equal ones are equal.
            _ => f64::NAN,
        };
        NotedInfo { info, note }
    }

    fn observation(&self, observation: &impl GoalObservation<Element = f64>) -> Observation {
        let mut copy = Observation {
            observation: observation.observation().into(),
            achieved_goal: observation.achieved_goal().into(),
            desired_goal: observation.desired_goal().into(),
        };
        if self.is(Fault::ShortObservation) {
            copy.observation.pop();
        }
        if self.is(Fault::RemembersEpisodes) {
            copy.observation[0] += 1e-9 * f64::from(self.episodes);
        }
        if self.is(Fault::HidesState) && self.was_left {
            copy.achieved_goal[2] += 1e-9;
        }
        if self.is(Fault::MovesTheGoal) {
            copy.desired_goal[0] += 1e-9 * f64::from(self.elapsed);
        }
        copy
    }
}

fn with_goals(goals: Space) -> Space {
    let observation = BoxSpace::<f64>::unbounded(25).expect("small").into();
    let keys =
        [("achieved_goal", goals.clone()), ("desired_goal", goals), ("observation", observation)];
    DictSpace::new(keys).expect("different keys").into()
}

fn dict(lengths: &[(&str, usize)]) -> Space {
    let space = |&(key, len)| (key, BoxSpace::<f64>::unbounded(len).expect("small").into());
    DictSpace::new(lengths.iter().map(space)).expect("different keys").into()
}

impl Env for Faulty {
    type Observation = Observation;
    type Info = NotedInfo;
    type ActionSpace = FaultyActions;
    type ResetOptions = FetchResetOptions;

    fn reset(&mut self, seed: Option<u64>) -> Result<Reset<Observation, NotedInfo>, EnvError> {
        let seed = match self.fault {
            Fault::DefaultsMatter => Some(7),
            _ => seed,
        };
        self.reset_with(seed, &FetchResetOptions::default())
    }

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &FetchResetOptions,
    ) -> Result<Reset<Observation, NotedInfo>, EnvError> {
        let seed = match (self.fault, seed) {
            (Fault::IgnoresTheSeed, _) => None,
            (Fault::RestartsTheStream, None) => Some(self.last_seed),
            (Fault::KnowsOneSeed, Some(_)) => Some(0),
            (Fault::UnseededIsZero, None) if self.episodes == 0 => Some(0),
            _ => seed,
        };
        self.last_seed = seed.unwrap_or(self.last_seed);
        self.episodes += 1;
        (self.elapsed, self.was_left) = (0, false);
        let Reset { observation, info } = self.env.reset_with(seed, options)?;
        Ok(Reset { observation: self.observation(&observation), info: self.noted(info) })
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<Observation, NotedInfo>, EnvError> {
        let mut action = action.to_vec();
        let [terminates, truncates] =
            [Fault::TerminatesAtOnce, Fault::TruncatesAtOnce].map(|fault| self.is(fault));
        if (terminates || truncates) && self.elapsed == 1 {
            return Err(EnvError::EpisodeOver);
        }
        match self.fault {
            Fault::TakesNan => action.iter_mut().for_each(|a| *a = a.clamp(-1.0, 1.0).max(-1.0)),
            Fault::TakesAnyLength => action.resize(4, 0.0),
            Fault::BadActionsMove if action.iter().any(|a| a.is_nan()) => {
                self.env.step(&[1.0; 4])?;
            }
            _ => {}
        }
        let step = match self.env.step(&action) {
            Err(EnvError::ResetNeeded) if self.is(Fault::StepsBeforeReset) => {
                self.env.reset(None)?;
                self.env.step(&action)
            }
            Err(EnvError::EpisodeOver) if self.is(Fault::StepsAfterTheEnd) => {
                self.env.reset(None)?;
                self.env.step(&action)
            }
            step => step,
        }?;
        self.elapsed += 1;
        self.was_left |= step.observation.grip_position()[1] > 0.9;
        let mut info = step.info;
        match self.fault {
            Fault::NeverSucceeds => info.is_success = false,
            Fault::LiesAboutSuccess => info.is_success = !info.is_success,
            Fault::LiesAboutDistance => info.distance = info.distance.next_up(),
            _ => {}
        }
        Ok(Step {
            observation: self.observation(&step.observation),
            reward: match self.fault {
                Fault::NanReward => f64::NAN,
                Fault::RewardOffByABit => step.reward.next_up(),
                _ => step.reward,
            },
            terminated: terminates || (self.is(Fault::Terminates) && self.elapsed == 20),
            truncated: match self.fault {
                Fault::TruncatesEarly => self.elapsed == 49,
                Fault::TruncatesLate => false,
                _ => truncates || step.truncated,
            },
            info: self.noted(info),
        })
    }

    fn action_space(&self) -> &FaultyActions {
        &self.action_space
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}

impl GoalEnv for Faulty {
    type GoalReward = FaultyReward;

    fn goal_reward(&self) -> &FaultyReward {
        &self.reward
    }
}

impl SnapshotEnv for Faulty {
    type Snapshot = (<KinematicEnv as SnapshotEnv>::Snapshot, u32, u32);

    fn snapshot(&self) -> Self::Snapshot {
        (self.env.snapshot(), self.episodes, self.elapsed)
    }

    fn restore(&mut self, snapshot: &Self::Snapshot) -> Result<(), EnvError> {
        if self.is(Fault::RestoresNothing) {
            return Ok(());
        }
        self.env.restore(&snapshot.0)?;
        if self.is(Fault::ForgetsTheEpisodes) {
            self.env.reset(Some(0))?;
        }
        if self.is(Fault::RestoresANewEnvironmentAsRunning) && snapshot.1 == 0 {
            self.env.reset(None)?;
        }
        (self.episodes, self.elapsed) = (snapshot.1, snapshot.2);
        Ok(())
    }
}
