//! Single environments that follow Gymnasium's autoreset rules, as the reference for batches.

use fetch_env::wrappers::Wrapped;
use fetch_env::{
    BoxSpace, Env, EnvError, FetchConfig, FetchEnv, FetchObservation, GoalObservation, Info,
    TimeLimit,
    vec_env::{AutoresetMode, VecConfig, VecEnv, VecStep},
};
use fetch_sim::{KinematicSimulator, SimConfig, Simulator, Task};
use goal_reward::RewardKind;
pub(crate) use testing::Result;
use testing::bits;

pub(crate) const MODES: [AutoresetMode; 3] =
    [AutoresetMode::NextStep, AutoresetMode::SameStep, AutoresetMode::Disabled];

pub(crate) type TestEnv<S> = Wrapped<FetchEnv<S>, TimeLimit>;

/// Environments whose episodes alternate in length, so that their ends do not coincide.
pub(crate) fn envs<S: Simulator>(
    count: usize,
    simulator: impl Fn(&SimConfig) -> S,
) -> Result<Vec<TestEnv<S>>> {
    let config = FetchConfig::new(Task::Push, RewardKind::Dense);
    (0..count)
        .map(|i| {
            let steps = if i % 2 == 0 { 5 } else { 7 };
            let config = config.clone().with_max_episode_steps(steps).expect("not 0");
            let simulator = simulator(config.sim());
            Ok(FetchEnv::new(config, simulator)?.time_limited())
        })
        .collect()
}

pub(crate) fn kinematic(config: &SimConfig) -> KinematicSimulator {
    KinematicSimulator::new(config)
}

pub(crate) fn vec_env(
    count: usize,
    config: VecConfig,
) -> Result<VecEnv<TestEnv<KinematicSimulator>>> {
    Ok(VecEnv::new(envs(count, kinematic)?, config)?)
}

/// Returns the action of an environment's `step`-th step.
pub(crate) fn action(env_index: usize, step: usize) -> [f32; 4] {
    let angle = (env_index * 37 + step * 11) as f32;
    [angle.sin(), (1.7 * angle).sin(), (0.3 * angle).cos() - 0.5, angle.cos()]
}

pub(crate) fn actions(count: usize, step: usize) -> Vec<f32> {
    (0..count).flat_map(|env_index| action(env_index, step)).collect()
}

/// Everything in a row, as bits.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) state: Vec<u64>,
    pub(crate) reward: u64,
    pub(crate) terminated: bool,
    pub(crate) truncated: bool,
    pub(crate) info: (bool, u64),
    pub(crate) last: Option<(Vec<u64>, (bool, u64))>,
}

fn info_bits(info: Info) -> (bool, u64) {
    (info.is_success, info.distance.to_bits())
}

fn observation_bits(observation: &FetchObservation) -> Vec<u64> {
    bits([observation.observation(), observation.achieved_goal(), observation.desired_goal()])
}

/// Returns the rows of a batch without errors.
pub(crate) fn rows(batch: &VecStep<FetchObservation>) -> Vec<Row> {
    assert_eq!(batch.errors().collect::<Vec<_>>(), []);
    (0..batch.len()).map(|row| row_of(batch, row)).collect()
}

pub(crate) fn row_of(batch: &VecStep<FetchObservation>, row: usize) -> Row {
    fn part(all: &[f64], len: usize, row: usize) -> &[f64] {
        all.chunks_exact(all.len() / len).nth(row).expect("a row")
    }
    let part = |all| part(all, batch.len(), row);
    let parts =
        [part(batch.observation()), part(batch.achieved_goal()), part(batch.desired_goal())];
    Row {
        state: bits(parts),
        reward: batch.reward()[row].to_bits(),
        terminated: batch.terminated()[row],
        truncated: batch.truncated()[row],
        info: batch.info()[row].map(info_bits).expect("an info"),
        last: batch.final_info()[row].map(|info| {
            let next = [
                part(batch.next_observation()),
                part(batch.next_achieved_goal()),
                part(batch.next_desired_goal()),
            ];
            (bits(next), info_bits(info))
        }),
    }
}

/// One environment with Gymnasium's autoreset, written as in its `SyncVectorEnv` (1.4.0).
pub(crate) struct Single<E> {
    env: E,
    mode: AutoresetMode,
    autoreset: bool,
    steps: usize,
}

impl<E: Env<Observation = FetchObservation, Info = Info, ActionSpace = BoxSpace<f32>>> Single<E> {
    pub(crate) fn new(env: E, mode: AutoresetMode) -> Self {
        Self { env, mode, autoreset: false, steps: 0 }
    }

    pub(crate) fn reset(&mut self, seed: Option<u64>) -> Result<Row, EnvError> {
        self.autoreset = false;
        let reset = self.env.reset(seed)?;
        Ok(Row {
            state: observation_bits(&reset.observation),
            reward: 0.0_f64.to_bits(),
            terminated: false,
            truncated: false,
            info: info_bits(reset.info),
            last: None,
        })
    }

    /// Whether its episode is over and it has no autoreset.
    pub(crate) fn needs_reset(&self) -> bool {
        self.autoreset && self.mode == AutoresetMode::Disabled
    }

    pub(crate) fn step(&mut self, env_index: usize) -> Result<Row, EnvError> {
        let action = action(env_index, self.steps);
        self.steps += 1;
        if self.autoreset {
            return self.reset(None);
        }
        let step = self.env.step(&action)?;
        let over = step.is_last();
        let mut row = Row {
            state: observation_bits(&step.observation),
            reward: step.reward.to_bits(),
            terminated: step.terminated,
            truncated: step.truncated,
            info: info_bits(step.info),
            last: None,
        };
        if over && self.mode == AutoresetMode::SameStep {
            let last = (row.state, row.info);
            let reset = self.reset(None)?;
            row = Row { state: reset.state, info: reset.info, last: Some(last), ..row };
        } else {
            self.autoreset = over;
        }
        Ok(row)
    }
}

pub(crate) fn singles<S: Simulator>(
    count: usize,
    mode: AutoresetMode,
    simulator: impl Fn(&SimConfig) -> S,
) -> Result<Vec<Single<TestEnv<S>>>> {
    Ok(envs(count, simulator)?.into_iter().map(|env| Single::new(env, mode)).collect())
}
