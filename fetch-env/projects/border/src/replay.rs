//! A prioritized hindsight buffer as border-core's replay buffer.

use anyhow::Result;
use border_core::{ExperienceBufferBase, ReplayBufferBase, Step, StepProcessor, TransitionBatch};
use fetch_env::{DistanceReward, FetchObservation, GoalObservation};
use her_relabel::{Batch, BufferConfig, HerBuffer, JoinedGoal, Sampler, StartData, TransitionId};

use crate::{FetchAct, FetchObs, GoalEnvironment};

/// A step on its way into the buffer, which stores whole episodes rather than transitions.
#[derive(Clone, Debug)]
pub struct HerStep {
    /// The first observation of the episode, if the step is its first.
    start: Option<FetchObservation>,
    action: FetchAct,
    reward: f32,
    next_observation: FetchObservation,
    terminated: bool,
    truncated: bool,
}

/// Turns the steps of an environment into those of the buffer.
#[derive(Clone, Debug, Default)]
pub struct HerSteps {
    start: Option<FetchObservation>,
}

impl StepProcessor<GoalEnvironment> for HerSteps {
    type Config = ();
    type Output = HerStep;

    fn build(_config: &()) -> Self {
        Self::default()
    }

    fn reset(&mut self, first: FetchObs) {
        self.start = Some(first.0);
    }

    fn process(&mut self, step: Step<GoalEnvironment>) -> HerStep {
        HerStep {
            start: self.start.take(),
            action: step.act,
            reward: step.reward[0],
            next_observation: step.obs.0,
            terminated: step.is_terminated[0] != 0,
            truncated: step.is_truncated[0] != 0,
        }
    }
}

/// Settings of a [`HerReplay`]. Draws are by priority if the settings of the buffer and the sampler
/// say so.
#[derive(Clone, Debug)]
pub struct HerReplayConfig {
    pub buffer: BufferConfig,
    pub sampler: Sampler,
    pub reward: DistanceReward,
    /// The priority of a transition is `(|error| + epsilon) ^ alpha`.
    pub epsilon: f32,
    pub alpha: f32,
}

/// The replay buffer. It has nothing to draw before the end of the first episode.
#[derive(Clone, Debug)]
pub struct HerReplay {
    config: HerReplayConfig,
    buffer: HerBuffer<f32>,
    batch: Batch<f32>,
    num_draws: u64,
}

impl HerReplay {
    pub const fn buffer(&self) -> &HerBuffer<f32> {
        &self.buffer
    }
}

impl ExperienceBufferBase for HerReplay {
    type Item = HerStep;

    fn push(&mut self, step: HerStep) -> Result<()> {
        if let Some(start) = &step.start {
            let start = StartData {
                observation: start.observation(),
                achieved_goal: start.achieved_goal(),
                desired_goal: start.desired_goal(),
            };
            self.buffer.begin_episode(0, &start)?;
        }
        let step = her_relabel::StepData {
            action: &step.action.0,
            reward: f64::from(step.reward),
            next_observation: step.next_observation.observation(),
            next_achieved_goal: step.next_observation.achieved_goal(),
            terminated: step.terminated,
            truncated: step.truncated,
            fields: &[],
        };
        Ok(self.buffer.add_step(0, &step)?)
    }

    fn len(&self) -> usize {
        self.buffer.len()
    }
}

impl ReplayBufferBase for HerReplay {
    type Config = HerReplayConfig;
    type Batch = HerBatch;

    /// # Panics
    /// If the settings are invalid: border has no error for it.
    fn build(config: &HerReplayConfig) -> Self {
        let buffer =
            HerBuffer::new(config.buffer.clone()).unwrap_or_else(|error| panic!("{error}"));
        Self { config: config.clone(), buffer, batch: Batch::new(), num_draws: 0 }
    }

    fn batch(&mut self, size: usize) -> Result<HerBatch> {
        let HerReplayConfig { sampler, reward, .. } = &self.config;
        let sampler = sampler.with_batch_size(size).with_joined_goal(JoinedGoal::Desired);
        self.num_draws += 1;
        sampler.sample(&self.buffer, reward, self.num_draws, &mut self.batch)?;
        let columns = self.batch.take_columns();
        let matrix = |elements: Vec<f32>| Matrix { width: elements.len() / size, elements };
        let flags = |flags: Vec<bool>| flags.into_iter().map(i8::from).collect();
        let ids = columns.transition.iter().map(|id| id.get() as usize);
        let is_prioritized = sampler.priorities().is_some();
        Ok(HerBatch {
            ixs: is_prioritized.then(|| ids.collect()),
            obs: matrix(columns.input),
            act: matrix(columns.action),
            next_obs: matrix(columns.next_input),
            reward: columns.reward,
            is_terminated: flags(columns.terminated),
            is_truncated: flags(columns.truncated),
            weight: is_prioritized.then_some(columns.importance_weight),
        })
    }

    /// # Panics
    /// If the transitions are not of this buffer or an error is NaN: border has no error for it.
    fn update_priority(&mut self, ixs: &Option<Vec<usize>>, errors: &Option<Vec<f32>>) {
        let (Some(ixs), Some(errors)) = (ixs, errors) else { return };
        let ids: Option<Vec<_>> = ixs.iter().map(|&ix| TransitionId::new(ix as u64)).collect();
        let HerReplayConfig { epsilon, alpha, .. } = self.config;
        let priorities: Vec<f32> =
            errors.iter().map(|error| (error.abs() + epsilon).powf(alpha)).collect();
        self.buffer
            .set_priorities(&ids.expect("numbers of transitions"), &priorities)
            .unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Row-major numbers, as tensors take them.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    pub width: usize,
    pub elements: Vec<f32>,
}

/// A batch: observations are followed by the goal to pursue.
#[derive(Clone, Debug)]
pub struct HerBatch {
    obs: Matrix,
    act: Matrix,
    next_obs: Matrix,
    reward: Vec<f32>,
    is_terminated: Vec<i8>,
    is_truncated: Vec<i8>,
    ixs: Option<Vec<usize>>,
    weight: Option<Vec<f32>>,
}

impl TransitionBatch for HerBatch {
    type ObsBatch = Matrix;
    type ActBatch = Matrix;

    fn unpack(
        self,
    ) -> (Matrix, Matrix, Matrix, Vec<f32>, Vec<i8>, Vec<i8>, Option<Vec<usize>>, Option<Vec<f32>>)
    {
        let Self { obs, act, next_obs, reward, is_terminated, is_truncated, ixs, weight } = self;
        (obs, act, next_obs, reward, is_terminated, is_truncated, ixs, weight)
    }

    fn len(&self) -> usize {
        self.reward.len()
    }

    fn obs(&self) -> &Matrix {
        &self.obs
    }

    fn act(&self) -> &Matrix {
        &self.act
    }
}
